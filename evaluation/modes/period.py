"""One control period of a robot as seen from outside, and the interface of an invariant."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from farhand.common.control_mode import Action, ControlMode, Phase
from farhand.common.wire.messages import Command, Message


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
    """Number of the sentence in `modes.md`, in the order of its section on invariants."""
    sentence: str | None
    """Sentence."""

    @abstractmethod
    def violation(self, period: Period) -> str:
        """Describe the violation; empty when there was none."""
