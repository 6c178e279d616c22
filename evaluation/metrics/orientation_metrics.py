"""Orientations of motions at equal fractions of their lengths: the error, and the warped mean as a competitor."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from farhand.local_site.teaching.demonstration import Demonstration

_N = 100


def turns_of(demonstration: Demonstration) -> Rotation:
    """Orientations seen from the goal at equal fractions of the length. 100 of them."""
    local = demonstration.frames_at(0)[-1].to_local(demonstration.points)
    steps = np.linalg.norm(np.diff(local[:, :3], axis=0), axis=1)
    travelled = np.concatenate([[0.0], np.cumsum(steps + 1e-12)])  # Slerp needs times that increase
    return Slerp(travelled, Rotation.from_quat(local[:, 3:], scalar_first=True))(
        np.linspace(0.0, travelled[-1], _N)
    )


def mean_turns(taught: Sequence[Rotation], start: Rotation) -> Rotation:
    """The mean of the demonstrations' orientations, turned so that it begins where it should."""
    mean = Rotation.concatenate(
        [Rotation.concatenate([turns[n] for turns in taught]).mean() for n in range(_N)]
    )
    off = (mean[0].inv() * start).as_rotvec()
    return mean * Rotation.from_rotvec(np.linspace(1.0, 0.0, _N)[:, None] * off)


def turn_rms_deg(a: Rotation, b: Rotation) -> float:
    """Root mean square angle between orientations."""
    return float(np.degrees(np.sqrt(np.mean((a.inv() * b).magnitude() ** 2))))
