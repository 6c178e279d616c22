"""Goals of manoeuvres: the end of a short straight motion, and its speed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from farhand.remote_site.interface.plant import EffectorState

Array = NDArray[np.float64]

SPEED = 0.5
"""Speed of manoeuvres as a share of the task's limit."""
BACK_OFF_M, BACK_OFF_S = 0.020, 2.0
_PATIENCE_S = 5.0


class ManoeuvreGoal(Protocol):
    """End and speed of a manoeuvre."""

    @property
    def time_limit_s(self) -> float:
        """Time limit at the full pace, after which the manoeuvre ends at its present place [s]."""
        ...

    def goal(self) -> Array:
        """Return the present estimate of the end. Shape (C,)."""
        ...

    def speed_m_s(self) -> float:
        """Return the present speed limit at the full pace [m/s]."""
        ...


@dataclass(frozen=True, eq=False)
class FixedGoal:
    """Goal that does not move.

    Args:
        place: Point of the goal. Shape (C,).
        speed: Speed at the full pace [m/s].
        time_limit_s: See `ManoeuvreGoal`.
    """

    place: Array
    speed: float
    time_limit_s: float

    @classmethod
    def to(cls, place: Array, start: Array, speed: float) -> FixedGoal:
        """Return a goal with a time limit that suits its distance from a start. Shapes (C,) and (C,)."""
        return cls(place, speed, patience_s(float(np.linalg.norm(place - start)), speed))

    def goal(self) -> Array:
        """See `ManoeuvreGoal`."""
        return self.place

    def speed_m_s(self) -> float:
        """See `ManoeuvreGoal`."""
        return self.speed


def giving_way(effector: EffectorState, speed_m_s: float) -> FixedGoal | None:
    """Return a goal in the direction of the force on the tool; None if no force is measured."""
    if effector.force_n is None:
        return None
    place, away = effector.point.copy(), effector.force_n / max(float(np.linalg.norm(effector.force_n)), 1e-9)
    place[: effector.n_dims] += BACK_OFF_M * away
    return FixedGoal(place, speed_m_s, BACK_OFF_S)


def patience_s(distance_m: float, speed_m_s: float) -> float:
    """Return the time limit of a path [s]."""
    return _PATIENCE_S + 2.0 * distance_m / speed_m_s
