"""Scripted operator's hand: where it wants the plug at any time.

It follows a path the way hands do: with a slow drift that fades towards the mouth, and tremor. Everything is
in the frame of the receptacle: the mouth is the origin, and z points into the bore. The target is sampled as
that of a gizmo dragged in a browser.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from farhand.local_site.workcell.scripted_paths import ScriptedPath

Array = NDArray[np.float64]

_DRIFT_M, _DRIFT_RAD, _DRIFT_S = 0.004, math.radians(1.0), 1.0
_TREMOR_M, _TREMOR_HZ = (0.0002, 0.0006), (8.0, 11.0)
# The drift is complete beyond this distance before the mouth; this share remains in the bore.
_CALM_FROM_M, _CALM = 0.12, 0.1
_SAMPLED_HZ, _GRID_S = 20.0, 0.05


class ScriptedHand:
    """Hand of one demonstration.

    Args:
        way: Path to follow.
        random: Random generator of drift and tremor.
    """

    def __init__(self, way: ScriptedPath, random: np.random.Generator):
        self._way = way
        self._drift = _ornstein_uhlenbeck(random, math.ceil(self.duration_s / _GRID_S) + 2)
        self._tremor_m = random.uniform(*_TREMOR_M) * random.normal(size=3)
        self._tremor_rad_s = 2.0 * math.pi * random.uniform(*_TREMOR_HZ)

    @property
    def duration_s(self) -> float:
        """Time from rest to rest [s]."""
        return self._way.duration_s

    def target(self, time_s: float) -> Array:
        """Return where it wants the plug's tip, in the receptacle's frame; 20 steps per second.

        Shape (7,).
        """
        t = math.floor(time_s * _SAMPLED_HZ + 1e-9) / _SAMPLED_HZ
        position, turn, free = self._way.at(t)
        drift = self._drift[min(int(t / _GRID_S), len(self._drift) - 1)]
        calm = min(max(-position[2] / _CALM_FROM_M, _CALM), 1.0) * free
        position += calm * (drift[:3] * _DRIFT_M + self._tremor_m * math.sin(self._tremor_rad_s * t))
        turn = turn * Rotation.from_rotvec(calm * drift[3:] * _DRIFT_RAD)
        return np.concatenate([position, turn.as_quat(scalar_first=True)])


def _ornstein_uhlenbeck(random: np.random.Generator, n: int) -> Array:
    """Return noise of unit variance that is correlated over a second. Shape (n, 6)."""
    keep = math.exp(-_GRID_S / _DRIFT_S)
    out = random.normal(size=(n, 6))
    for k in range(1, n):
        out[k] = keep * out[k - 1] + math.sqrt(1.0 - keep**2) * out[k]
    return out
