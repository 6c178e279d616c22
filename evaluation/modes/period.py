"""One control period of a robot as it looks from outside, and what an invariant of it is."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from farhand.common.control_mode import Action, ControlMode, Phase
from farhand.common.wire.messages import Command, Message


@dataclass(frozen=True)
class Arrived:
    """A message that reached the robot.

    Args:
        message: It.
        sent_s: When it was first handed to the link [s].
        arrived_s: When it came [s].
    """

    message: Message
    sent_s: float
    arrived_s: float

    @property
    def flight_s(self) -> float:
        """Time under way [s]."""
        return self.arrived_s - self.sent_s


@dataclass(frozen=True)
class Ran:
    """A command that the robot did.

    Args:
        command: It.
        flight_s: How long it was under way [s].
        lease_id: Of who was in control at that moment, empty for nobody.
    """

    command: Command
    flight_s: float
    lease_id: str


@dataclass(frozen=True)
class Snapshot:
    """The robot at one moment.

    Args:
        boot: Of the robot.
        mode: Its mode.
        phase: What AUTONOMOUS is at.
        lease_id: Of who is in control, empty for nobody.
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
        time_s: When [s].
        dt_s: How long [s].
        before: The robot at its beginning.
        between: When all that had arrived was done, before it moved.
        after: At its end.
        arrived: What was done in it.
        ran: The commands that were done in it.
        usual_age_s: How old a message usually is, as the robot has learned it; zero before that [s].
    """

    time_s: float
    dt_s: float
    before: Snapshot
    between: Snapshot
    after: Snapshot
    arrived: tuple[Arrived, ...]
    ran: tuple[Ran, ...]
    usual_age_s: float

    def did(self, *actions: Action) -> list[Ran]:
        """List the completed commands of these actions; without arguments, of all."""
        return [ran for ran in self.ran if not actions or ran.command.action in actions]


class Invariant(ABC):
    """Something that holds in every control period."""

    number: str
    """Of the sentence in `modes.md`, in the order of its section on invariants."""
    sentence: str | None
    """The sentence."""

    @abstractmethod
    def violation(self, period: Period) -> str:
        """Describe the violation; empty when there was none."""
