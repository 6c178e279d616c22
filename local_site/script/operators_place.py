"""Surroundings of the scripted operator: a console, a link that can be cut, and time, real or virtual."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal, Protocol

from farhand.common.clock import elapsed_s
from farhand.common.wire.messages import ExecutionReport
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.console.intents import Intent

OutageKind = Literal["stall", "reset", "blackhole"]


@dataclass(frozen=True)
class PlannedOutage:
    """Planned cut of the link during the execution.

    Args:
        kind: Kind of outage.
        duration_s: Duration of the cut [s].
        at: Share of the previewed motion after which the cut begins, from 0 to 1.
    """

    kind: OutageKind
    duration_s: float
    at: float = 0.5


class OperatedConsole(Protocol):
    """Part of a `Console` that the script uses."""

    @property
    def picture(self) -> ConsoleState:
        """Present state of the console."""
        ...

    def submit(self, intent: Intent) -> None:
        """Submit an intent."""
        ...

    def wait_for(self, holds: Callable[[ConsoleState], bool], timeout_s: float) -> bool:
        """Wait until the picture satisfies a condition. Return False on a time-out."""
        ...

    def ask_report(self) -> ExecutionReport | None:
        """Ask the robot for the report of its newest execution; None when no answer came."""
        ...


class CuttableLink(Protocol):
    """Part of a `RelayControl` that the script uses."""

    def outage(self, kind: OutageKind, duration_s: float) -> Mapping[str, Any]:
        """Interrupt both directions for a while [s]."""
        ...

    def status(self) -> Mapping[str, Any]:
        """Return the settings and the traffic."""
        ...


class OperatorsTime(Protocol):
    """Time of the scripted operator."""

    def now_s(self) -> float:
        """Return the present time [s]."""
        ...

    def pause(self, duration_s: float) -> None:
        """Pause for a duration [s]."""
        ...


class RealTime:
    """Time of this machine."""

    def now_s(self) -> float:
        """Return the present time [s]."""
        return elapsed_s()

    def pause(self, duration_s: float) -> None:
        """See `OperatorsTime.pause`."""
        threading.Event().wait(duration_s)
