"""One control period of a robot as seen from outside, and the interface of an invariant.

With further rules of the modes that can be checked in every control period, beside the numbered invariants.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from farhand.common.mode_table import Action, ControlMode, Phase
from farhand.common.task import Task
from farhand.common.wire.messages import Command, Message, OperatorInput


@dataclass(frozen=True)
class Arrived:
    """Message that reached the robot.

    Args:
        message: The message.
        sent_s: Time when it was first handed to the link [s].
        arrived_s: Time of its arrival [s].
    """

    message: Message
    sent_s: float
    arrived_s: float

    @property
    def flight_s(self) -> float:
        """Time in transit [s]."""
        return self.arrived_s - self.sent_s


@dataclass(frozen=True)
class Ran:
    """Command that the robot executed.

    Args:
        command: The command.
        flight_s: Time in transit [s].
        lease_id: Lease of the site in control at that moment, empty for none.
    """

    command: Command
    flight_s: float
    lease_id: str


@dataclass(frozen=True)
class RobotSnapshot:
    """Robot at one moment.

    Args:
        boot: Boot of the robot.
        mode: Its mode.
        phase: Phase of AUTONOMOUS.
        lease_id: Lease of the site in control, empty for none.
        coupling: Coupling id and lease of the coupling, None without one.
        position_m: Shape (D,) [m].
        velocity_m_s: Shape (D,) [m/s].
    """

    boot: str
    mode: ControlMode
    phase: Phase
    lease_id: str
    coupling: tuple[int, str] | None
    position_m: NDArray[np.float64]
    velocity_m_s: NDArray[np.float64]

    @property
    def speed_m_s(self) -> float:
        """Magnitude of the velocity [m/s]."""
        return float(np.linalg.norm(self.velocity_m_s))


@dataclass(frozen=True)
class Period:
    """One control period.

    Args:
        time_s: Time of the period [s].
        dt_s: Its duration [s].
        before: The robot at its beginning.
        between: The robot after all arrived messages were handled, before it moved.
        after: At its end.
        arrived: Messages handled in it.
        ran: Commands executed in it.
        usual_age_s: Usual age of a message, as the robot has learned it; zero before that [s].
    """

    time_s: float
    dt_s: float
    before: RobotSnapshot
    between: RobotSnapshot
    after: RobotSnapshot
    arrived: tuple[Arrived, ...]
    ran: tuple[Ran, ...]
    usual_age_s: float

    def did(self, *actions: Action) -> list[Ran]:
        """List the completed commands of these actions; without arguments, of all."""
        return [ran for ran in self.ran if not actions or ran.command.action in actions]


class Invariant(ABC):
    """Property that holds in every control period."""

    number: str
    """Number of the invariant, see `invariants.py`."""
    sentence: str | None
    """Sentence."""

    @abstractmethod
    def violation(self, period: Period) -> str:
        """Describe the violation; empty when there was none."""


INPUT_SILENCE_S = 0.5
_STANDING_M_S = 5e-3


class DeadMan(Invariant):
    """No input event for 0.5 s: the robot stops where it is."""

    number = "Driving"
    sentence = __doc__

    def __init__(self, task: Task):
        self._brake_s = task.limits.speed_m_s / task.limits.acceleration_m_s2
        self._newest_s = -np.inf

    def violation(self, period: Period) -> str:
        """See `Invariant.violation`."""
        if any(isinstance(each.message, OperatorInput) for each in period.arrived):
            self._newest_s = period.time_s
        silent_s = period.time_s - self._newest_s
        if period.before.mode is not ControlMode.DIRECT or period.after.mode is not ControlMode.DIRECT:
            return ""
        late = silent_s > INPUT_SILENCE_S + self._brake_s + 2 * period.dt_s
        if late and period.after.speed_m_s > _STANDING_M_S and period.before.speed_m_s > _STANDING_M_S:
            return (
                f"{silent_s:.2f} s after the last input the robot moves at {period.after.speed_m_s:.3f} m/s"
            )
        return ""


class AtMostOnce(Invariant):
    """Commands run at most once in a boot."""

    number = "Freshness"
    sentence = __doc__

    def __init__(self) -> None:
        self._ran: set[tuple[str, str]] = set()

    def violation(self, period: Period) -> str:
        """See `Invariant.violation`."""
        for ran in period.ran:
            key = (period.between.boot, ran.command.command_id)
            if key in self._ran:
                return f"{ran.command.action} ran twice"
            self._ran.add(key)
        return ""
