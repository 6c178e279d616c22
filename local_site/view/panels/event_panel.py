"""Panel of events here and at the robot, the newest first: refusals with their reasons, ends of commands."""

from __future__ import annotations

import time
from collections import deque

import viser

from farhand.common.clock import elapsed_s
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.exchange.notices import Notice
from farhand.local_site.view.panels.html import Html, clock, text

_SHOWN = 80
_LATE_S = 2.0
"""An event that was so long on its way was held up by an outage, and is shown when it happened [s]."""


class EventPanel:
    """Events in the lower strip. Used by the page's thread.

    Args:
        gui: GUI of the server.
    """

    def __init__(self, gui: viser.GuiApi):
        self._html = Html(gui)
        self._own: deque[Notice] = deque(maxlen=_SHOWN)
        self._wall_s = time.time() - elapsed_s()
        """The console's clock in wall time, for people."""
        self._shown: tuple[Notice, ...] | None = None

    def explain(self, words: str) -> None:
        """Tell the operator why the page itself did nothing."""
        if not self._own or self._own[-1].text != words or elapsed_s() - self._own[-1].time_s > 1.0:
            self._own.append(Notice(elapsed_s(), "page", words, good=False))

    def draw(self, picture: ConsoleState) -> None:
        """Show the newest events."""
        notices = sorted([*picture.notices[-_SHOWN:], *self._own], key=lambda notice: notice.time_s)[-_SHOWN:]
        if self._shown == (shown := tuple(notices)):
            return
        self._shown = shown
        lines = [self._line(notice, newest=notice is notices[-1]) for notice in reversed(notices)]
        self._html.show(
            '<div class="fh-lower fh-log"><div class="fh-caption">events, the newest first</div>'
            f'<div class="fh-messages" data-tp="messages">{"".join(lines)}</div></div>'
        )

    def _line(self, notice: Notice, newest: bool) -> str:
        kind = ("fh-said" if notice.good else "fh-refused") + " fh-newest" * newest
        at_s = self._wall_s + notice.time_s - (notice.late_s if notice.late_s > _LATE_S else 0.0)
        return (
            f'<div data-tp="message" class="{kind}" title="{text(robot_clock(notice))}">'
            f"{clock(at_s)}{text(words(notice))}</div>"
        )


def words(notice: Notice) -> str:
    """Return the event as one line."""
    late = f", heard {notice.late_s:.0f} s later" if notice.late_s > _LATE_S else ""
    by = f" [{notice.who}]" if notice.who else ""
    if notice.text.startswith(notice.what) and not by:
        return f"{notice.text}{late}"  # avoids "executing: executing hot-stab"
    return f"{notice.what}{by}: {notice.text}{late}"


def robot_clock(notice: Notice) -> str:
    """Return the time of an event on the clock that applies to it."""
    if notice.robot_s is None:
        return "this site's own; its clock"
    return f"{notice.robot_s:.2f} s on the robot's clock; the time shown is this site's"
