"""Scripted operator's hand: where it wants the plug at any time.

It follows a path the way hands do: with a slow drift that fades towards the mouth, and tremor. Everything is
in the frame of the receptacle: the mouth is the origin, and z points into the bore. The target is sampled as
that of a gizmo dragged in a browser.

Paths of a scripted hand with a hot stab: into the receptacle, and out of it.

Each varies as people do: in path, speed, and the places and durations of pauses. Everything is in the frame
of the receptacle: the mouth is the origin, and z points into the bore.
"""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

Array = NDArray[np.float64]

STANDOFF_M = 0.12
"""Distance before the mouth at which an extracted plug is held [m]."""

_REACH_S, _PAUSE_S, _INSERT_S, _WITHDRAW_S, _REST_S = (3.5, 5.0), (0.2, 0.8), (4.0, 5.5), (4.5, 6.0), 0.8
_BEFORE_M, _ASIDE_M, _VIA_M, _STANDOFF_STD_M = (0.10, 0.14), 0.006, 0.025, 0.003
_DEEPER_M = -0.002  # beyond the bore's bottom: where the hand stops pushing
_ALIGNED = (1.0, 0.0, 0.0, 0.0)


class ScriptedPath(Protocol):
    """Path of the plug's tip over time."""

    @property
    def duration_s(self) -> float:
        """Time from rest to rest [s]."""
        ...

    def at(self, time_s: float) -> tuple[Array, Rotation, float]:
        """Return position (3,) [m], orientation, and how freely the hand drifts, from 0 to 1."""
        ...


class ScriptedInsertion:
    """Path to a point before the mouth, a pause, and into the bore.

    Args:
        start: First pose of the plug's tip. Shape (7,).
        depth_m: Depth of the bore [m].
        random: Random generator of everything that varies.
    """

    def __init__(self, start: Array, depth_m: float, random: np.random.Generator):
        self._start = np.array(start[:3])
        standoff_m = random.uniform(*_BEFORE_M)
        self._aside = np.array([*random.normal(0.0, _ASIDE_M, 2), 0.0])
        self._before = np.array([0.0, 0.0, -standoff_m])
        self._via = 0.5 * (self._start + self._before) + random.normal(0.0, _VIA_M, 3)
        self._end = np.array([0.0, 0.0, depth_m + _DEEPER_M])
        self._reach_s, self._pause_s = random.uniform(*_REACH_S), random.uniform(*_PAUSE_S)
        self._insert_s = random.uniform(*_INSERT_S)
        self._turn = _aligning(start)

    @property
    def duration_s(self) -> float:
        """See `ScriptedPath.duration_s`."""
        return self._reach_s + self._pause_s + self._insert_s + _REST_S

    def at(self, time_s: float) -> tuple[Array, Rotation, float]:
        """See `ScriptedPath.at`."""
        reached = _minimum_jerk(time_s / self._reach_s)
        inserted = (time_s - self._reach_s - self._pause_s) / self._insert_s
        return self._reached(reached) + self._inserted(inserted), self._turn(reached), min(5.0 * reached, 1.0)

    def _reached(self, part: float) -> Array:
        """Return a point on the curve through the via point to beside the point before the mouth."""
        before = self._before + self._aside
        return (1 - part) ** 2 * self._start + 2 * (1 - part) * part * self._via + part**2 * before

    def _inserted(self, part: float) -> Array:
        """Return a point on the rest of the path: to the axis in the first half, then along it."""
        return _minimum_jerk(part) * (self._end - self._before) - _minimum_jerk(2.0 * part) * self._aside


class ScriptedExtraction:
    """Path of an extraction: a pause, and straight out of the bore to a point before the mouth.

    Args:
        start: First pose of the plug's tip, in the bore. Shape (7,).
        random: Random generator of everything that varies.
    """

    def __init__(self, start: Array, random: np.random.Generator):
        self._start = np.array(start[:3])
        self._end = np.array([0.0, 0.0, -STANDOFF_M]) + random.normal(0.0, _STANDOFF_STD_M, 3)
        self._pause_s, self._withdraw_s = random.uniform(*_PAUSE_S), random.uniform(*_WITHDRAW_S)
        self._turn = _aligning(start)

    @property
    def duration_s(self) -> float:
        """See `ScriptedPath.duration_s`."""
        return self._pause_s + self._withdraw_s + _REST_S

    def at(self, time_s: float) -> tuple[Array, Rotation, float]:
        """See `ScriptedPath.at`."""
        part = _minimum_jerk((time_s - self._pause_s) / self._withdraw_s)
        return (
            self._start + part * (self._end - self._start),
            self._turn(part),
            min(5.0 * part, 5.0 * (1.0 - part), 1.0),
        )


def _aligning(start: Array) -> Slerp:
    """Return the rotation from a start's orientation (at 0) to the receptacle's (at 1)."""
    return Slerp([0.0, 1.0], Rotation.from_quat([start[3:], _ALIGNED], scalar_first=True))


def _minimum_jerk(tau: float) -> float:
    tau = min(max(tau, 0.0), 1.0)
    return tau**3 * (10.0 - 15.0 * tau + 6.0 * tau**2)


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
