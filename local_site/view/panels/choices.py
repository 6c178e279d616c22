"""Choices of the operator that last: the task, the robot's pace, and sending the model whenever it changes."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import viser

from farhand.common.clock import elapsed_s
from farhand.common.mode_table import Action, ControlMode
from farhand.common.task import PointTask
from farhand.common.wire.messages import SLOWEST_PACE
from farhand.local_site.console import intents
from farhand.local_site.console.console_state import ConsoleState, TaskStanding
from farhand.local_site.exchange.report_age import LinkHealth
from farhand.local_site.view.panels.html import Html, element, text
from farhand.local_site.view.panels.words.controls import Field, Hint
from farhand.local_site.view.panels.words.lists import standing_words
from farhand.local_site.view.scene.nodes import Layers

Submit = Callable[[intents.Intent], None]
Act = Callable[[int, Callable[[], None]], None]


class AutoSendSwitch:
    """Switch that shows the console's state, not the click.

    Args:
        gui: GUI of the server.
        submit: Hands an intent to the console.
        act: Has a tab's action done, from the server's thread; only enqueues.
    """

    def __init__(self, gui: viser.GuiApi, submit: Submit, act: Act):
        self._box = gui.add_checkbox(Field.AUTO_SEND, initial_value=False)

        @self._box.on_update
        async def _(event: viser.GuiEvent[viser.GuiCheckboxHandle]) -> None:
            if event.client_id is not None:
                act(event.client_id, partial(submit, intents.AutoSend(bool(event.target.value))))

    def draw(self, state: ConsoleState) -> None:
        """Show the console's state."""
        if self._box.value != state.auto_send:
            self._box.value = state.auto_send


HIDDEN = (55, 65, 81)
"""Colour of a chip whose part of the picture is hidden."""
_STILL_S = 0.3
"""Rest of the slider after which its value is sent, because a drag has dozens of values [s]."""
_STEP_PERCENT = 5.0
_AFTER_THE_BUTTONS = 1000.0
_PACED = (ControlMode.HOLD, ControlMode.AUTONOMOUS, ControlMode.PAUSED)
"""Modes in which the robot moves on its own, or is about to."""


def add_height_slider(gui: viser.GuiApi, task: PointTask, act: Act, lift: Callable[[float], None]) -> None:
    """Add the slider of the hand's height, for a task in space that is taught over a board.

    Args:
        gui: GUI of the server.
        task: Task, whose workspace and start limit and begin the height.
        act: Has a tab's action done, from the server's thread.
        lift: Moves the hand to a height [m].
    """
    slider = gui.add_slider(
        Field.HEIGHT, 0.0, task.workspace_m[2], step=0.01, initial_value=task.start_m[2], order=_AFTER_THE_BUTTONS,
        hint=Hint.HEIGHT,
    )  # fmt: skip

    @slider.on_update
    async def _(event: viser.GuiEvent[viser.GuiSliderHandle[float]]) -> None:
        if event.client_id is not None:
            act(event.client_id, partial(lift, float(event.target.value)))


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
            Field.SPEED, 100.0 * SLOWEST_PACE, 100.0, step=_STEP_PERCENT, initial_value=100.0, order=_AFTER_THE_BUTTONS,
            hint=Hint.SPEED,
        )  # fmt: skip

        @self._slider.on_update
        async def _(event: viser.GuiEvent[viser.GuiSliderHandle[float]]) -> None:
            if event.client_id is not None:
                act(event.client_id, partial(self._move, float(event.target.value), elapsed_s()))

    def draw(self, state: ConsoleState, now_s: float) -> None:
        """Send the chosen value once the slider rests; otherwise show the reported one."""
        robot, sending = state.robot, Action.SET_PACE in state.pending
        moves = state.mode in _PACED and state.link.health is not LinkHealth.LOST
        if self._slider.visible != moves:
            self._slider.visible = moves
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


class TaskChoice:
    """Choice that shows the console's state, not the click; hidden when there is only one task.

    Args:
        gui: GUI of the server.
        state: First state of the console.
        submit: Hands an intent to the console.
        act: Has a tab's action done, from the server's thread; only enqueues.
    """

    def __init__(self, gui: viser.GuiApi, state: ConsoleState, submit: Submit, act: Act):
        names = tuple(task.name for task in state.tasks)
        gui.add_html(
            '<i class="fh-here fh-here-task"></i>'
            if len(names) > 1
            else '<i class="fh-here fh-here-none"></i>'
        )
        self._choice: viser.GuiDropdownHandle[str] = gui.add_dropdown(
            Field.TASK, names, visible=len(names) > 1
        )

        @self._choice.on_update
        async def _(event: viser.GuiEvent[viser.GuiDropdownHandle[str]]) -> None:
            if event.client_id is not None:
                act(event.client_id, partial(submit, intents.Choose(event.target.value)))

    def draw(self, state: ConsoleState) -> None:
        """Show the console's state."""
        if self._choice.value != state.task.name:
            self._choice.value = state.task.name


class Standings:
    """List of the tasks: how often each was taught, and whether the robot has its model.

    Args:
        gui: GUI of the server.
    """

    def __init__(self, gui: viser.GuiApi):
        self._html = Html(gui)

    def draw(self, state: ConsoleState) -> None:
        """Show the console's state."""
        self._html.show(f'<div class="fh-tasks">{"".join(map(_line, state.tasks))}</div>')


class Legend:
    """Chips that name the scene's layers by colour, and hide and show them.

    Args:
        gui: GUI of the server.
        layers: Layers of the scene.
        act: Has a tab's action done, from the server's thread; only enqueues.
    """

    def __init__(self, gui: viser.GuiApi, layers: Layers, act: Act):
        self._layers = layers
        self._chips = {name: gui.add_button(name, hint=Hint.LAYER.format(name)) for name in layers.colours}
        for name, chip in self._chips.items():

            @chip.on_click
            async def _(event: viser.GuiEvent[viser.GuiButtonHandle], name: str = name) -> None:
                if event.client_id is not None:
                    act(event.client_id, partial(layers.toggle, name))

    def draw(self) -> None:
        """Fill the chips of the shown layers with their colour."""
        for name, chip in self._chips.items():
            colour = self._layers.colours[name] if self._layers.shown(name) else HIDDEN
            if chip.color != colour:
                chip.color = colour


def _line(task: TaskStanding) -> str:
    return f"<div><b>{text(task.name)}</b> {element(f'standing-{task.name}', standing_words(task))}</div>"
