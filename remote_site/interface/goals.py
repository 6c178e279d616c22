"""Goals of manoeuvres: where a short straight motion leads, and how fast."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from farhand.remote_site.interface.plant import EffectorState

Array = NDArray[np.float64]

SPEED = 0.5
"""Of the task's limit."""
BACK_OFF_M, BACK_OFF_S = 0.020, 2.0
_PATIENCE_S = 5.0


class ManoeuvreGoal(Protocol):
    """Where a manoeuvre leads, and how fast."""

    @property
    def time_limit_s(self) -> float:
        """After which it ends where it is, at the full pace [s]."""
        ...

    def goal(self) -> Array:
        """Return where it ends, as known now. Shape (C,)."""
        ...

    def speed_m_s(self) -> float:
        """Return how fast it may go now, at the full pace [m/s]."""
        ...


@dataclass(frozen=True, eq=False)
class FixedGoal:
    """A place that stays where it is.

    Args:
        place: Shape (C,).
        speed: At the full pace [m/s].
        time_limit_s: See `ManoeuvreGoal`.
    """

    place: Array
    speed: float
    time_limit_s: float

    @classmethod
    def to(cls, place: Array, start: Array, speed: float) -> FixedGoal:
        """Return a goal with time enough to get there from a start. Shapes (C,) and (C,)."""
        return cls(place, speed, patience_s(float(np.linalg.norm(place - start)), speed))

    def goal(self) -> Array:
        """See `ManoeuvreGoal`."""
        return self.place

    def speed_m_s(self) -> float:
        """See `ManoeuvreGoal`."""
        return self.speed


def giving_way(effector: EffectorState, speed_m_s: float) -> FixedGoal | None:
    """Return the place where the force on the tool pushes it; None where no force is measured."""
    if effector.force_n is None:
        return None
    place, away = effector.point.copy(), effector.force_n / max(float(np.linalg.norm(effector.force_n)), 1e-9)
    place[: effector.n_dims] += BACK_OFF_M * away
    return FixedGoal(place, speed_m_s, BACK_OFF_S)


def patience_s(distance_m: float, speed_m_s: float) -> float:
    """Return how long a way may take at most [s]."""
    return _PATIENCE_S + 2.0 * distance_m / speed_m_s
