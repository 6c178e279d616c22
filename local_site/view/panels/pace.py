"""Slider of the robot's pace; it shows what the robot reported."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import viser

from farhand.common.clock import elapsed_s
from farhand.common.control_mode import Action
from farhand.common.wire.messages import SLOWEST_PACE
from farhand.local_site.console import intents
from farhand.local_site.console.console_state import ConsoleState

Submit = Callable[[intents.Intent], None]
Act = Callable[[int, Callable[[], None]], None]

_STILL_S = 0.3
"""The slider is at rest for so long before its value is sent: on the way there are dozens."""
_STEP_PERCENT = 5.0


class PaceSlider:
    """Slider in percent. Used by the page's thread alone, except for its callback, which only enqueues.

    Args:
        gui: GUI of the server.
        submit: Hands an intent to the console.
        act: Has a tab's action done, from the server's thread.
    """

    def __init__(self, gui: viser.GuiApi, submit: Submit, act: Act):
        self._submit = submit
        self._wanted: float | None = None
        self._moved_s = 0.0
        self._slider = gui.add_slider(
            "Speed [%]", 100.0 * SLOWEST_PACE, 100.0, step=_STEP_PERCENT, initial_value=100.0,
            hint="Of what the robot does by itself: executions, Retract, Go to ready. Not of your own driving.",
        )  # fmt: skip

        @self._slider.on_update
        async def _(event: viser.GuiEvent[viser.GuiSliderHandle[float]]) -> None:
            if event.client_id is not None:
                act(event.client_id, partial(self._move, float(event.target.value), elapsed_s()))

    def draw(self, picture: ConsoleState, now_s: float) -> None:
        """Send the chosen value once the slider rests; else show what the robot reported."""
        robot, sending = picture.robot, Action.SET_PACE in picture.pending
        if self._wanted is not None:
            if not sending and now_s - self._moved_s >= _STILL_S:
                pace = min(max(self._wanted / 100.0, SLOWEST_PACE), 1.0)
                self._submit(intents.CommandRobot(Action.SET_PACE, pace=pace))
                self._wanted, self._moved_s = None, now_s
        elif robot is not None and not sending and now_s - self._moved_s >= _STILL_S:
            shown = round(100.0 * robot.pace, 1)
            if self._slider.value != shown:
                self._slider.value = shown

    def _move(self, percent: float, at_s: float) -> None:
        self._wanted, self._moved_s = percent, at_s
