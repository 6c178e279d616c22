"""Piece of HTML on the page, sent only when it has changed."""

from __future__ import annotations

import html
import time
from datetime import UTC, datetime
from typing import Any

import viser

from farhand.common.clock import elapsed_s


class Html:
    """Piece of HTML.

    Args:
        gui: GUI of the server, or of one tab.
        content: First content.
    """

    def __init__(self, gui: viser.GuiApi, content: str = ""):
        self._handle = gui.add_html(content)
        self._content = content

    def show(self, content: str) -> None:
        """Show a content."""
        if content != self._content:
            self._content = content
            self._handle.content = content

    def remove(self) -> None:
        """Remove the content from the page."""
        self._handle.remove()


def element(name: str, text: object, kind: str = "", tag: str = "span", **attributes: Any) -> str:
    """Return an element with the attribute `data-tp` by which tests find it, its text escaped."""
    more = "".join(f' {key}="{html.escape(str(value))}"' for key, value in attributes.items())
    return f'<{tag} data-tp="{name}" class="{kind}"{more}>{html.escape(str(text))}</{tag}>'


def wall_start_s() -> float:
    """Return the wall time at the beginning of the clock of ages [s]: what is told by that clock has a time of day for people."""
    return time.time() - elapsed_s()


def clock(at_s: float) -> str:
    """Return the time of day of a moment, in the viewer's own zone, which `page.js` fills in, or else in UTC.

    Args:
        at_s: Seconds since the epoch.
    """
    at = datetime.fromtimestamp(at_s, UTC)
    return f'<time datetime="{at.isoformat(timespec="milliseconds")}">{at:%H:%M:%S} UTC</time>'


def text(value: object) -> str:
    """Return a value as escaped text."""
    return html.escape(str(value))
