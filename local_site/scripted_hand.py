"""A scripted operator's hand that inserts a hot stab: where it wants the plug at any time.

It varies as hands do: the way it takes, where it waits before the mouth and for how long, how fast it is, a
slow drift that fades towards the mouth, and tremor. Everything is in the frame of the receptacle: the mouth
is the origin, and z points into the bore. Its target is sampled as a dragged gizmo in a browser is.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

Array = NDArray[np.float64]

_REACH_S, _PAUSE_S, _INSERT_S, _REST_S = (3.5, 5.0), (0.2, 0.8), (4.0, 5.5), 0.8
_STANDOFF_M, _ASIDE_M, _VIA_M = (0.10, 0.14), 0.006, 0.025
_DEEPER_M = -0.002  # than the bore: where the hand stops pushing
_DRIFT_M, _DRIFT_RAD, _DRIFT_S = 0.004, math.radians(1.0), 1.0
_TREMOR_M, _TREMOR_HZ = (0.0002, 0.0006), (8.0, 11.0)
# The drift is whole beyond this distance before the mouth, and this part of it is left in the bore.
_CALM_FROM_M, _CALM = 0.12, 0.1
_SAMPLED_HZ, _GRID_S = 20.0, 0.05


class ScriptedHand:
    """One demonstration's hand.

    Args:
        start: Where the plug's tip is at first, in the frame of the receptacle. A pose. Shape (7,).
        depth_m: Of the bore [m].
        random: Of everything that varies.
    """

    def __init__(self, start: Array, depth_m: float, random: np.random.Generator):
        self._start = np.array(start[:3])
        standoff_m = random.uniform(*_STANDOFF_M)
        self._aside = np.array([*random.normal(0.0, _ASIDE_M, 2), 0.0])
        self._before = np.array([0.0, 0.0, -standoff_m])
        self._via = 0.5 * (self._start + self._before) + random.normal(0.0, _VIA_M, 3)
        self._end = np.array([0.0, 0.0, depth_m + _DEEPER_M])
        self._reach_s, self._pause_s = random.uniform(*_REACH_S), random.uniform(*_PAUSE_S)
        self._insert_s = random.uniform(*_INSERT_S)
        turns = Rotation.from_quat([start[3:], (1.0, 0.0, 0.0, 0.0)], scalar_first=True)
        self._turn = Slerp([0.0, 1.0], turns)
        self._drift = _ornstein_uhlenbeck(random, math.ceil(self.duration_s / _GRID_S) + 2)
        self._tremor_m = random.uniform(*_TREMOR_M) * random.normal(size=3)
        self._tremor_rad_s = 2.0 * math.pi * random.uniform(*_TREMOR_HZ)

    @property
    def duration_s(self) -> float:
        """From rest to rest [s]."""
        return self._reach_s + self._pause_s + self._insert_s + _REST_S

    def target(self, time_s: float) -> Array:
        """Where it wants the plug's tip, in the frame of the receptacle; steps 20 times a second. Shape (7,)."""
        t = math.floor(time_s * _SAMPLED_HZ + 1e-9) / _SAMPLED_HZ
        reached = _minimum_jerk(t / self._reach_s)
        inserted = (t - self._reach_s - self._pause_s) / self._insert_s
        position = self._reached(reached) + self._inserted(inserted)
        drift = self._drift[min(int(t / _GRID_S), len(self._drift) - 1)]
        calm = min(max(-position[2] / _CALM_FROM_M, _CALM), 1.0) * min(5.0 * reached, 1.0)
        position += calm * (drift[:3] * _DRIFT_M + self._tremor_m * math.sin(self._tremor_rad_s * t))
        turn = self._turn(reached) * Rotation.from_rotvec(calm * drift[3:] * _DRIFT_RAD)
        return np.concatenate([position, turn.as_quat(scalar_first=True)])

    def _reached(self, part: float) -> Array:
        """On a curve through the via point to beside the point before the mouth."""
        before = self._before + self._aside
        return (1 - part) ** 2 * self._start + 2 * (1 - part) * part * self._via + part**2 * before

    def _inserted(self, part: float) -> Array:
        """From there: to the axis in the first half, and along it."""
        return _minimum_jerk(part) * (self._end - self._before) - _minimum_jerk(2.0 * part) * self._aside


def _ornstein_uhlenbeck(random: np.random.Generator, n: int) -> Array:
    """Noise of unit variance that is correlated over a second. Shape (n, 6)."""
    keep = math.exp(-_GRID_S / _DRIFT_S)
    out = random.normal(size=(n, 6))
    for k in range(1, n):
        out[k] = keep * out[k - 1] + math.sqrt(1.0 - keep**2) * out[k]
    return out


def _minimum_jerk(tau: float) -> float:
    tau = min(max(tau, 0.0), 1.0)
    return tau**3 * (10.0 - 15.0 * tau + 6.0 * tau**2)
