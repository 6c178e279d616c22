"""Panel of the task's revisions, and the way back to one of them."""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime

import viser

from farhand.local_site.console import intents
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.teaching.revisions import Revision
from farhand.local_site.view.panels.html import Html, clock

Submit = Callable[[intents.Intent], None]
Act = Callable[[int, Callable[[], None]], None]

_NONE: str = "nothing was taught yet"


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
        self._choice: viser.GuiDropdownHandle[str] = gui.add_dropdown("Revision", self._labels)
        self._made = Html(gui)
        self._buttons = {
            "Go to": gui.add_button("Go to", color="blue", disabled=True),
            "Delete": gui.add_button("Delete", color="gray", disabled=True),
        }
        self._on("Go to", lambda: intents.SelectRevision(self._chosen()))
        self._on("Delete", lambda: intents.Delete(self._chosen()))

    def draw(self, picture: ConsoleState) -> None:
        """Show the kept revisions; the current one is selected until another one is chosen."""
        labels = tuple(map(_label, picture.revisions)) or (_NONE,)
        numbers = tuple(revision.number for revision in picture.revisions) or (0,)
        if (labels, picture.revision) != (self._labels, self._present):
            chosen = self._chosen()
            followed = chosen == self._present or chosen not in numbers
            self._labels, self._numbers, self._present = labels, numbers, picture.revision
            shown = picture.revision if followed and picture.revision in numbers else chosen
            if self._choice.options != labels:
                self._choice.options = labels
            self._choice.value = labels[numbers.index(shown)] if shown in numbers else labels[-1]
        made = next((each.made for each in picture.revisions if each.number == self._chosen()), "")
        at = clock(datetime.fromisoformat(made).timestamp()) if made else ""
        self._made.show(f'<div class="fh-note" data-tp="made">{at and f"made at {at}"}</div>')
        another = self._chosen() not in (0, picture.revision) and not picture.recording
        self._enable("Go to", another)
        self._enable("Delete", another)

    def _chosen(self) -> int:
        value = self._choice.value
        return self._numbers[self._labels.index(value)] if value in self._labels else 0

    def _enable(self, label: str, enabled: bool) -> None:
        if self._buttons[label].disabled == enabled:
            self._buttons[label].disabled = not enabled

    def _on(self, label: str, make: Callable[[], intents.Intent]) -> None:
        @self._buttons[label].on_click
        async def _(event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
            if event.client_id is not None:
                self._act(event.client_id, lambda: self._submit(make()))


def _label(revision: Revision) -> str:
    n = len(revision.demonstrations)
    return f"{revision.number}: {n} demonstration{'' if n == 1 else 's'}"
