"""The surroundings of the scripted operator: a console, a link that can be cut, and time, real or virtual."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal, Protocol

from farhand.common.clock import elapsed_s
from farhand.common.wire.messages import ExecutionReport
from farhand.local_site.console.intents import Intent
from farhand.local_site.console.picture import Picture

OutageKind = Literal["stall", "reset", "blackhole"]


@dataclass(frozen=True)
class PlannedOutage:
    """A planned cut of the link during the execution.

    Args:
        kind: How it is cut.
        duration_s: For how long [s].
        at: When this part of the previewed motion is done, from 0 to 1.
    """

    kind: OutageKind
    duration_s: float
    at: float = 0.5


class OperatedConsole(Protocol):
    """The part of a `Console` that the script uses."""

    @property
    def picture(self) -> Picture:
        """The console's present state."""
        ...

    def submit(self, intent: Intent) -> None:
        """Ask for something."""
        ...

    def wait_for(self, holds: Callable[[Picture], bool], timeout_s: float) -> bool:
        """Wait until the picture has a property. False when it did not in time."""
        ...

    def ask_report(self) -> ExecutionReport | None:
        """Ask the robot for the report of its newest execution; None when no answer came."""
        ...


class CuttableLink(Protocol):
    """The part of a `RelayControl` that the script uses."""

    def outage(self, kind: OutageKind, duration_s: float) -> Mapping[str, Any]:
        """Interrupt both directions for a while [s]."""
        ...

    def status(self) -> Mapping[str, Any]:
        """Ask for the settings and the traffic."""
        ...


class OperatorsTime(Protocol):
    """The time."""

    def now_s(self) -> float:
        """Return the time [s]."""
        ...

    def pause(self, duration_s: float) -> None:
        """Let time pass [s]."""
        ...


class RealTime:
    """The time of this machine."""

    def now_s(self) -> float:
        """Return the time [s]."""
        return elapsed_s()

    def pause(self, duration_s: float) -> None:
        """See `OperatorsTime.pause`."""
        threading.Event().wait(duration_s)
