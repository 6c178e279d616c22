"""Demonstrations one by one: hide or delete one, save one, the model or the events as a file of one's own, and learn one from a file."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import viser

from farhand.local_site.console import intents
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.console.intent_permission import refusal_of
from farhand.local_site.exchange.notices import encode
from farhand.local_site.teaching.demonstration import Demonstration
from farhand.local_site.view.panels.choices import Act, Submit
from farhand.local_site.view.panels.html import wall_start_s
from farhand.local_site.view.panels.words.controls import NO_DEMONSTRATION, Field, Label
from farhand.local_site.view.panels.words.lists import demonstration_label, upload_words
from farhand.local_site.view.scene.nodes import Layers
from farhand.local_site.view.uploads import MOST_FILE_BYTES

Save = Callable[[int, str, bytes], None]
"""Has a tab's browser save a file: the tab, the file's name, and its content."""

_NONE: tuple[str, ...] = (NO_DEMONSTRATION,)


class FilePanel:
    """Choice of a demonstration, with what can be done to it. Its callbacks only enqueue.

    Args:
        gui: GUI of the server.
        submit: Hands an intent to the console.
        act: Has a tab's action done, from the server's thread.
        save: Has a tab's browser save a file.
        layers: What the operator hides and shows in the scene.
    """

    def __init__(self, gui: viser.GuiApi, submit: Submit, act: Act, save: Save, layers: Layers):
        self._submit, self._act, self._save, self._layers = submit, act, save, layers
        self._state: ConsoleState | None = None
        self._names: dict[str, str] = {}
        """Name of each demonstration by its label; another object whenever they change."""
        self._choice: viser.GuiDropdownHandle[str] = gui.add_dropdown(
            Field.DEMONSTRATION, _NONE, visible=False
        )
        self._hide = gui.add_button(Label.HIDE_DEMONSTRATION, color="gray", visible=False)
        self._delete = gui.add_button(Label.DELETE_DEMONSTRATION, color="gray", visible=False)
        self._download = gui.add_button(Label.DOWNLOAD_DEMONSTRATION, color="gray", visible=False)
        self._upload = gui.add_upload_button(Label.UPLOAD_DEMONSTRATION, mime_type=".npz", color="gray")
        gui.add_html(
            f'<div class="fh-hint" data-most-bytes="{MOST_FILE_BYTES}">{upload_words(MOST_FILE_BYTES)}</div>'
        )
        self._download_model = gui.add_button(Label.DOWNLOAD_MODEL, color="gray", visible=False)
        # Chosen when it is pressed, not when it is done: a second press means the same one, and is refused.
        self._on(self._hide, lambda _: partial(layers.toggle_demonstration, self._chosen()))
        self._on(self._delete, lambda _: partial(submit, intents.RemoveDemonstration(self._chosen())))
        self._on(self._download, lambda tab: partial(self._save_demonstration, tab, self._chosen()))
        self._upload.on_upload(self._uploaded)
        self._on(self._download_model, lambda tab: partial(self._save_model, tab))
        self._wall_s = wall_start_s()
        """Wall time at the beginning of the console's clock [s]."""
        download_events = gui.add_button(Label.DOWNLOAD_EVENTS, color="gray")
        self._on(download_events, lambda tab: partial(self._save_events, tab))

    def draw(self, state: ConsoleState) -> None:
        """Show the current demonstrations; one stays chosen until it is gone, at first the newest."""
        self._state = state
        before, names = tuple(self._names.values()), state.demonstration_names
        if names != before:
            chosen = self._chosen()
            labels = tuple(_label(*each) for each in enumerate(state.demonstrations, 1)) or _NONE
            at = names.index(chosen) if chosen in names and chosen != before[-1] else -1
            self._names = dict(zip(labels, names, strict=False))
            self._choice.options = labels
            self._choice.value = labels[at]
        away = self._chosen() in self._layers.hidden_demonstrations
        label = Label.SHOW_DEMONSTRATION if away else Label.HIDE_DEMONSTRATION
        if self._hide.label != label:
            self._hide.label = label
        removable = refusal_of(intents.RemoveDemonstration(self._chosen()), state) is None
        for handle, possible in (
            (self._choice, bool(state.demonstrations)),
            (self._hide, bool(state.demonstrations)),
            (self._download, bool(state.demonstrations)),
            (self._delete, removable),
            (self._upload, refusal_of(intents.LearnFile("", b""), state) is None),
            (self._download_model, state.learned is not None),
        ):
            if handle.visible != possible:
                handle.visible = possible

    def _chosen(self) -> str:
        return self._names.get(self._choice.value, "")

    def _save_demonstration(self, tab: int, name: str) -> None:
        state = self._state
        if state is not None and name in state.demonstration_names:
            made = state.demonstrations[state.demonstration_names.index(name)]
            self._save(tab, f"{state.task.name}-{name}", made.encode())

    def _save_model(self, tab: int) -> None:
        state = self._state
        if state is not None and state.learned is not None:
            self._save(tab, f"{state.task.name}-revision-{state.revision}.farhand", state.learned.content)

    def _save_events(self, tab: int) -> None:
        if self._state is not None:
            self._save(tab, "events.jsonl", encode(self._state.notices, self._wall_s))

    async def _uploaded(self, event: viser.GuiEvent[viser.GuiUploadButtonHandle]) -> None:
        if event.client_id is not None:
            file = event.target.value
            self._act(event.client_id, partial(self._submit, intents.LearnFile(file.name, file.content)))

    def _on(self, button: viser.GuiButtonHandle, job: Callable[[int], Callable[[], None]]) -> None:
        async def pressed(event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
            if event.client_id is not None:
                self._act(event.client_id, job(event.client_id))

        button.on_click(pressed)


def _label(number: int, made: Demonstration) -> str:
    seconds = made.time_s[-1] - made.time_s[0]
    return demonstration_label(number, made.source, float(seconds))
