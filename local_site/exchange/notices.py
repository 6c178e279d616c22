"""Messages for the operator: the newest in memory for the page, all of them in a file."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, Protocol

from farhand.common.json_lines import JsonLinesFile, json_line

_KEPT = 200


@dataclass(frozen=True)
class Notice:
    """Message for the operator.

    Args:
        time_s: Time on the console's clock [s].
        what: Action or kind of event.
        text: Event and reason.
        good: False for a refusal or a failure.
        measured: Measured value that belongs to it, if any.
        who: Site that caused it; empty for the robot itself, and for this site.
        robot_s: Time of the event on the robot's clock [s]; None for an event at this site.
        late_s: Time beyond the usual delay that an outage held it up [s].
        code: Code of the reason, empty for none: behaviour depends on it and never on the text.
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
    """Callback with a message for the operator."""

    def __call__(self, what: str, text: str, good: bool = True) -> None:
        """Show a message to the operator."""
        ...


class Notices:
    """Newest messages. Used by the console's thread alone.

    Args:
        log: Log of every message; None to keep only the newest.
    """

    def __init__(self, log: JsonLinesFile | None):
        self._log = log
        self._newest: deque[Notice] = deque(maxlen=_KEPT)

    def add(self, notice: Notice) -> None:
        """Add a message."""
        self._newest.append(notice)
        if self._log is not None:
            self._log.append(**_fields(notice))

    def newest(self) -> tuple[Notice, ...]:
        """Return the newest messages, the newest last."""
        return tuple(self._newest)


def encode(notices: Sequence[Notice], wall_s: float) -> bytes:
    """Encode messages as the lines of a log, in the order of their times: an outage holds some of them up.

    Args:
        notices: The messages.
        wall_s: Wall time at the beginning of the console's clock [s].
    """
    ordered = sorted(notices, key=lambda notice: notice.time_s)
    return b"".join(
        json_line(datetime.fromtimestamp(wall_s + notice.time_s, UTC), _fields(notice)) for notice in ordered
    )


def _fields(notice: Notice) -> dict[str, Any]:
    return {
        "what": notice.what, "who": notice.who, "text": notice.text, "good": notice.good, "measured": notice.measured,
        "robot_s": notice.robot_s, "code": notice.code,
    }  # fmt: skip
