"""Looking back over this session: a slider on the timeline, and the mark over a picture that is not of now.

Every command stays governed by the present: of those that move the robot none is offered while the picture is old.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import viser

from farhand.common.clock import elapsed_s
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.view.history import History, Moment
from farhand.local_site.view.panels.choices import Act
from farhand.local_site.view.panels.html import Html, element
from farhand.local_site.view.panels.words.controls import SPANS, Field, Folder, Hint, Label
from farhand.local_site.view.panels.words.status import past_words

_SPANS: dict[str, float] = dict(zip(SPANS, (120.0, 900.0, 0.0), strict=True))
"""Spans of the timeline by their names [s]; that of the session is as long as it took."""
_LEAST_S = 120.0
_STEP_S = 1.0
_STILL_S = 0.5
"""Rest of the slider after which it is moved on with the time [s]."""


@dataclass(frozen=True)
class Look:
    """Span of the timeline, and the moment that the robot's half shows.

    Args:
        span_s: Span of the timeline, which ends now [s].
        then_s: Time of the moment that the robot's half shows, on the console's clock [s]; None for now.
    """

    span_s: float = _LEAST_S
    then_s: float | None = None


def must_see_now(state: ConsoleState) -> bool:
    """Decide whether the operator must see the present: the hand moves the robot or records, or a stop is on its way."""
    stop = state.stop
    return state.coupled or state.recording or (stop is not None and not stop.settled)


class LookingBack:
    """Slider, span and mark. Used by the page's thread alone, except for the callbacks, which only enqueue.

    Args:
        gui: GUI of the server.
        act: Has a tab's action done, from the server's thread; only enqueues.
    """

    def __init__(self, gui: viser.GuiApi, act: Act):
        self._act = act
        self._span, self._then_s = SPANS[0], None
        self._moved_s = float("-inf")
        with gui.add_folder(Folder.TIME):
            gui.add_html('<i class="fh-here fh-here-time"></i>')
            self._slider = gui.add_slider(Field.LOOK_BACK, -_LEAST_S, 0.0, step=_STEP_S, initial_value=0.0)
            self._spans = gui.add_button(self._span, color="gray", hint=Hint.SPAN)
        with gui.add_folder(Folder.PAST):
            gui.add_html('<i class="fh-here fh-here-past"></i>')
            self._mark = Html(gui)
            self._back = gui.add_button(Label.BACK_TO_NOW, color="blue", visible=False)

        @self._slider.on_update
        async def _(event: viser.GuiEvent[viser.GuiSliderHandle[float]]) -> None:
            if event.client_id is not None:
                act(event.client_id, partial(self._look, float(event.target.value), elapsed_s()))

        self._hear(self._spans, self._next_span)
        self._hear(self._back, self.back_to_now)

    def back_to_now(self) -> None:
        """Show the present again."""
        self._then_s, self._moved_s = None, float("-inf")

    def draw(self, state: ConsoleState, history: History, now_s: float) -> tuple[Look, Moment | None]:
        """Show where the operator looks.

        Returns:
            Span and time that are looked at, and the moment of that time; None for now.
        """
        if must_see_now(state):
            self.back_to_now()
        span_s = _SPANS[self._span] or max(math.ceil((now_s - history.began_s) / 60.0) * 60.0, _LEAST_S)
        then = history.at(self._then_s) if self._then_s is not None else None
        if then is None:
            self._then_s = None
        self._draw_slider(span_s, now_s)
        self._draw_mark(then, now_s)
        return Look(span_s, self._then_s), then

    def _draw_slider(self, span_s: float, now_s: float) -> None:
        if self._slider.min != -span_s:
            self._slider.min = -span_s
        back_s = 0.0 if self._then_s is None else float(round(now_s - self._then_s))
        value = -min(back_s, span_s)
        if now_s - self._moved_s >= _STILL_S and self._slider.value != value:
            self._slider.value = value

    def _draw_mark(self, then: Moment | None, now_s: float) -> None:
        words = past_words(then, now_s) if then is not None and self._then_s is not None else ""
        self._mark.show(
            f'<div class="fh-past-frame"></div>{element("past", words, "fh-past", tag="div")}'
            if words
            else ""
        )
        if self._back.visible != bool(words):
            self._back.visible = bool(words)

    def _look(self, value_s: float, at_s: float) -> None:
        self._moved_s = at_s
        self._then_s = at_s + value_s if math.isfinite(value_s) and value_s <= -_STEP_S else None

    def _next_span(self) -> None:
        names = list(_SPANS)
        self._span = names[(names.index(self._span) + 1) % len(names)]
        self._spans.label = self._span

    def _hear(self, button: viser.GuiButtonHandle, do: Callable[[], None]) -> None:
        @button.on_click
        async def _(event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
            if event.client_id is not None:
                self._act(event.client_id, do)
