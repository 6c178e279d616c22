"""What the operator should read: kept in memory for the page, and in a file for good."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Protocol

from farhand.common.event_log import EventLog

_KEPT = 200


@dataclass(frozen=True)
class Notice:
    """Something that the operator should read.

    Args:
        time_s: On the console's clock [s].
        what: The action or the kind of event.
        text: What happened, and why.
        good: False for a refusal or a failure.
        measured: A measured value that goes with it, if any.
        who: The site that caused it; empty for the robot itself, and for this site.
        robot_s: When it happened at the robot, on the robot's own clock [s]; None for what happened here.
        late_s: How much longer than usual it was on its way: an outage held it up [s].
        code: Of the reason, where it has one: behaviour depends on it and never on the text.
    """

    time_s: float
    what: str
    text: str
    good: bool = True
    measured: float | None = None
    who: str = ""
    robot_s: float | None = None
    late_s: float = 0.0
    code: str = ""


class Tell(Protocol):
    """Tells the operator something."""

    def __call__(self, what: str, text: str, good: bool = True) -> None:
        """What it is about, the words, and whether they are good ones."""
        ...


class Notices:
    """The newest ones. Used by the console's thread alone.

    Args:
        log: Keeps every one; None keeps the newest alone.
    """

    def __init__(self, log: EventLog | None):
        self._log = log
        self._newest: deque[Notice] = deque(maxlen=_KEPT)

    def add(self, notice: Notice) -> None:
        """Take one."""
        self._newest.append(notice)
        if self._log is not None:
            self._log.append(
                what=notice.what, who=notice.who, text=notice.text, good=notice.good, measured=notice.measured,
                robot_s=notice.robot_s, code=notice.code,
            )  # fmt: skip

    def newest(self) -> tuple[Notice, ...]:
        """The newest last."""
        return tuple(self._newest)
