"""Player of the preview: the ghost moves along the previewed path, on its own once, and as its slider is dragged."""

from __future__ import annotations

from functools import partial

import numpy as np
import viser
from numpy.typing import NDArray

from farhand.common.clock import elapsed_s
from farhand.common.mode_table import ControlMode
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.view.panels.choices import Act
from farhand.local_site.view.panels.words.controls import Field, Folder, Hint, Label
from farhand.local_site.view.scene.ghost import along, shown_path, shown_points

Array = NDArray[np.float64]

_STEP_S, _SHOWN_PERIOD_S, _STILL_S = 0.1, 0.25, 0.5
"""Step of the slider, time between two of its own moves, and its rest after a drag before it moves again [s]."""


class PreviewPlayer:
    """Button and slider over the canvas, drawn while a preview is valid. Its callbacks only enqueue.

    Args:
        gui: GUI of the server.
        act: Has a tab's action done, from the server's thread; only enqueues.
    """

    def __init__(self, gui: viser.GuiApi, act: Act):
        self._plan, self._at_s, self._plays = 0, 0.0, False
        self._ticked_s = self._moved_s = self._shown_s = float("-inf")
        with gui.add_folder(Folder.PLANNED_MOTION, visible=False) as self._folder:
            gui.add_html('<i class="fh-here fh-here-preview"></i>')
            self._button = gui.add_button(Label.FREEZE, color="gray", hint=Hint.PLAY)
            self._slider = gui.add_slider(Field.PREVIEW_AT, 0.0, 10.0, step=_STEP_S, initial_value=0.0)

        @self._slider.on_update
        async def _(event: viser.GuiEvent[viser.GuiSliderHandle[float]]) -> None:
            if event.client_id is not None:
                act(event.client_id, partial(self._drag, float(event.target.value)))

        @self._button.on_click
        async def _(event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
            if event.client_id is not None:
                act(event.client_id, self._press)

    @property
    def plays(self) -> bool:
        """True while the ghost moves on its own."""
        return self._plays

    def draw(self, state: ConsoleState | None, now_s: float) -> Array | None:
        """Move the ghost on.

        Args:
            state: Present state of the console; None while the operator looks back.
            now_s: Present time on the console's clock [s].

        Returns:
            Point of the previewed path, in the task frame. Shape (C,); None without a preview.
        """
        path = shown_path(state) if state is not None and state.mode is ControlMode.HOLD else None
        points = shown_points(state) if state is not None and path is not None else None
        if self._folder.visible != (points is not None):
            self._folder.visible = points is not None
        if path is None or points is None:
            self._plays = False
            return None
        duration_s = (len(points) - 1) * path.step_s
        if path.plan_id != self._plan:
            self._plan, self._at_s, self._plays = path.plan_id, 0.0, True
            self._slider.max, self._ticked_s = max(round(duration_s, 1), _STEP_S), now_s
        if self._plays:
            self._at_s = min(self._at_s + now_s - self._ticked_s, duration_s)
            self._plays = self._at_s < duration_s
        self._ticked_s = now_s
        self._show(now_s)
        return along(points, self._at_s / path.step_s)

    def _show(self, now_s: float) -> None:
        label, value = Label.FREEZE if self._plays else Label.PLAY, round(self._at_s, 1)
        if self._button.label != label:
            self._button.label = label
        due = not self._plays or now_s - self._shown_s >= _SHOWN_PERIOD_S
        if due and now_s - self._moved_s >= _STILL_S and self._slider.value != value:
            self._slider.value, self._shown_s = value, now_s

    def _drag(self, at_s: float) -> None:
        self._at_s, self._plays, self._moved_s = min(max(at_s, 0.0), self._slider.max), False, elapsed_s()

    def _press(self) -> None:
        self._plays, self._ticked_s = not self._plays, elapsed_s()
        if self._plays and self._at_s >= self._slider.max - _STEP_S:
            self._at_s = 0.0
