"""One motion whose numbers are computed by hand, written in the ways of other programs."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from farhand.local_site.recordings.importing import Understood, understand
from farhand.local_site.recordings.options import ImportOptions

N = 11
TIMES_S = [0.05 * k for k in range(N)]
POSITIONS_M = [(0.1 + 0.01 * k, 0.2, 0.3 - 0.02 * k) for k in range(N)]
DEGREES = [10.0 * k for k in range(N)]
"""Turn about the vertical axis."""
QUATS_WXYZ = [(math.cos(math.radians(d) / 2), 0.0, 0.0, math.sin(math.radians(d) / 2)) for d in DEGREES]
SAMPLES = list(zip(TIMES_S, POSITIONS_M, QUATS_WXYZ, strict=True))


def read(file: Path, **options) -> list[Understood]:
    return understand(file, ImportOptions(**options))


def assert_true(understood: Understood, *, oriented: bool = True, n_dims: int = 3, tolerance: float = 1e-9):
    """The motion is the one of this module."""
    made = understood.demonstration
    np.testing.assert_allclose(made.time_s, TIMES_S, atol=1e-6)
    np.testing.assert_allclose(made.position_m, np.array(POSITIONS_M)[:, :n_dims], atol=tolerance)
    assert (made.quat_wxyz is not None) == oriented
    if made.quat_wxyz is not None:
        same = np.abs(np.sum(made.quat_wxyz * np.array(QUATS_WXYZ), axis=1))
        np.testing.assert_allclose(same, 1.0, atol=tolerance)


def words(understood: Understood, subject: str) -> str:
    """What the preview says about a subject."""
    return "; ".join(text for name, text in understood.told if name == subject)
