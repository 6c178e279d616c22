"""Paths of a scripted hand with a hot stab: into the receptacle, and out of it.

Each varies as people do: in path, speed, and the places and durations of pauses. Everything is in the frame
of the receptacle: the mouth is the origin, and z points into the bore.
"""

from __future__ import annotations

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
