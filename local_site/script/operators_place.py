"""What the scripted operator has around it: a console, a link that it can cut, and time, real or virtual."""

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
    """When the link is to be cut during the execution.

    Args:
        kind: How it is cut.
        duration_s: For how long [s].
        at: When this part of the previewed motion is done, from 0 to 1.
    """

    kind: OutageKind
    duration_s: float
    at: float = 0.5


class OperatedConsole(Protocol):
    """What is needed of a `Console`."""

    @property
    def picture(self) -> Picture:
        """What it shows."""
        ...

    def submit(self, intent: Intent) -> None:
        """Ask for something."""
        ...

    def wait_for(self, holds: Callable[[Picture], bool], timeout_s: float) -> bool:
        """Wait until the picture has a property. False when it did not in time."""
        ...

    def ask_report(self) -> ExecutionReport | None:
        """How the newest execution went, asked of the robot. None when no answer came."""
        ...


class CuttableLink(Protocol):
    """What is needed of a `RelayControl`."""

    def outage(self, kind: OutageKind, duration_s: float) -> Mapping[str, Any]:
        """Interrupt both directions for a while [s]."""
        ...

    def status(self) -> Mapping[str, Any]:
        """The settings and the traffic."""
        ...


class OperatorsTime(Protocol):
    """The time."""

    def now_s(self) -> float:
        """The time [s]."""
        ...

    def pause(self, duration_s: float) -> None:
        """Let time pass [s]."""
        ...


class RealTime:
    """The time of this machine."""

    def now_s(self) -> float:
        """See `OperatorsTime.now_s`."""
        return elapsed_s()

    def pause(self, duration_s: float) -> None:
        """See `OperatorsTime.pause`."""
        threading.Event().wait(duration_s)
