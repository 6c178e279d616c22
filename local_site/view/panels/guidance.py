"""Line of advice to the operator: the next step, or the refusal of the last request."""

from __future__ import annotations

import viser

from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.view.panels.html import Html, element
from farhand.local_site.view.panels.words.advice import advice, miss_words, preview_miss_words, refusal
from farhand.local_site.view.panels.words.controls import NEXT, NOT_DONE
from farhand.local_site.view.panels.words.scripts import in_narrow_window


class AdvicePanel:
    """Panel with the advice. Used by the page's thread.

    Args:
        gui: GUI of the server.
    """

    def __init__(self, gui: viser.GuiApi):
        self._html = Html(gui)

    def draw(self, state: ConsoleState) -> None:
        """Show the advice."""
        refused = refusal(state)
        told = element("refusal", refused, "fh-not-done", tag="div", role="status") if refused else ""
        for name, missed in (("miss", miss_words(state)), ("preview-miss", preview_miss_words(state))):
            told += element(name, missed, "fh-not-done", tag="div", role="status") if missed else ""
        words, hidden = advice(state), {"hidden": ""} if refused else {}
        narrow = {"data-in-narrow": in_narrow_window(words)}
        self._html.show(
            f'<div class="fh-advice"><i>{NOT_DONE if refused else NEXT}</i>{told}'
            f"{element('advice', words, tag='div', **narrow, **hidden)}</div>"
        )
