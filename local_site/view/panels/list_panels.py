"""Panels that list: events here and at the robot, and the task's revisions with the way back to one of them."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from datetime import datetime

import viser

from farhand.common.clock import elapsed_s
from farhand.local_site.console import intents
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.console.intent_permission import refusal_of
from farhand.local_site.exchange.notices import Notice
from farhand.local_site.view.panels.choices import Act, Submit
from farhand.local_site.view.panels.html import Html, clock, text, wall_start_s
from farhand.local_site.view.panels.words.controls import EVENTS, EVENTS_CAPTION, NO_REVISION, Field, Label
from farhand.local_site.view.panels.words.lists import (
    LATE_S,
    event_words,
    made_words,
    revision_label,
    robot_clock,
)

_SHOWN = 80


class EventPanel:
    """Events in the lower strip. Used by the page's thread.

    Args:
        gui: GUI of the server.
    """

    def __init__(self, gui: viser.GuiApi):
        self._html = Html(gui)
        self._own: deque[Notice] = deque(maxlen=_SHOWN)
        self._wall_s = wall_start_s()
        """The console's clock in wall time, for people."""
        self._shown: tuple[Notice, ...] | None = None

    def explain(self, words: str) -> None:
        """Tell the operator why the page itself did nothing."""
        if not self._own or self._own[-1].text != words or elapsed_s() - self._own[-1].time_s > 1.0:
            self._own.append(Notice(elapsed_s(), "page", words, good=False))

    def draw(self, state: ConsoleState) -> None:
        """Show the newest events."""
        notices = sorted([*state.notices[-_SHOWN:], *self._own], key=lambda notice: notice.time_s)[-_SHOWN:]
        if self._shown == (shown := tuple(notices)):
            return
        self._shown = shown
        lines = [self._line(notice, newest=notice is notices[-1]) for notice in reversed(notices)]
        self._html.show(
            f'<div class="fh-lower fh-log"><div class="fh-caption">{EVENTS_CAPTION}</div>'
            f'<div class="fh-messages" data-tp="messages" tabindex="0" role="log" aria-live="off" aria-label="{EVENTS}">{"".join(lines)}</div></div>'
        )

    def _line(self, notice: Notice, newest: bool) -> str:
        kind = ("fh-said" if notice.good else "fh-refused") + " fh-newest" * newest
        at_s = self._wall_s + notice.time_s - (notice.late_s if notice.late_s > LATE_S else 0.0)
        return (
            f'<div data-tp="message" class="{kind}" title="{text(robot_clock(notice))}">'
            f"{clock(at_s)}{text(event_words(notice))}</div>"
        )


_NONE: str = NO_REVISION


class LibraryPanel:
    """Choice of a revision, and buttons for the chosen one. Its callbacks only enqueue.

    Args:
        gui: GUI of the server.
        submit: Hands an intent to the console.
        act: Has a tab's action done, from the server's thread.
    """

    def __init__(self, gui: viser.GuiApi, submit: Submit, act: Act):
        self._submit, self._act = submit, act
        self._labels: tuple[str, ...] = (_NONE,)
        self._numbers: tuple[int, ...] = (0,)
        self._present = 0
        self._choice: viser.GuiDropdownHandle[str] = gui.add_dropdown(Field.REVISION, self._labels)
        self._made = Html(gui)
        self._buttons: dict[Label, viser.GuiButtonHandle] = {
            Label.GO_TO: gui.add_button(Label.GO_TO, color="blue", disabled=True),
            Label.DELETE: gui.add_button(Label.DELETE, color="gray", disabled=True),
        }
        self._makes: dict[Label, Callable[[], intents.Intent]] = {
            Label.GO_TO: lambda: intents.SelectRevision(self._chosen()),
            Label.DELETE: lambda: intents.Delete(self._chosen()),
        }
        for label, make in self._makes.items():
            self._on(label, make)

    def draw(self, state: ConsoleState) -> None:
        """Show the kept revisions; the current one is selected until another one is chosen."""
        labels = tuple(map(revision_label, state.revisions)) or (_NONE,)
        numbers = tuple(revision.number for revision in state.revisions) or (0,)
        if (labels, state.revision) != (self._labels, self._present):
            chosen = self._chosen()
            followed = chosen == self._present or chosen not in numbers
            self._labels, self._numbers, self._present = labels, numbers, state.revision
            shown = state.revision if followed and state.revision in numbers else chosen
            if self._choice.options != labels:
                self._choice.options = labels
            self._choice.value = labels[numbers.index(shown)] if shown in numbers else labels[-1]
        made = next((each.made for each in state.revisions if each.number == self._chosen()), "")
        at = clock(datetime.fromisoformat(made).timestamp()) if made else ""
        self._made.show(f'<div class="fh-note" data-tp="made">{at and made_words(at)}</div>')
        for label, make in self._makes.items():
            self._enable(label, refusal_of(make(), state) is None)

    def _chosen(self) -> int:
        value = self._choice.value
        return self._numbers[self._labels.index(value)] if value in self._labels else 0

    def _enable(self, label: Label, enabled: bool) -> None:
        if self._buttons[label].disabled == enabled:
            self._buttons[label].disabled = not enabled

    def _on(self, label: Label, make: Callable[[], intents.Intent]) -> None:
        @self._buttons[label].on_click
        async def _(event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
            if event.client_id is not None:
                self._act(event.client_id, lambda: self._submit(make()))
