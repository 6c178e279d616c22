"""Choice of the task that is taught, previewed and executed, with the standing of each task."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import viser

from farhand.local_site.console import intents
from farhand.local_site.console.console_state import ConsoleState, TaskStanding
from farhand.local_site.view.panels.html import Html, element, text

Submit = Callable[[intents.Intent], None]
Act = Callable[[int, Callable[[], None]], None]


class TaskChoice:
    """Choice that shows the console's state, not the click; hidden when there is only one task.

    Args:
        gui: GUI of the server.
        picture: First state of the console.
        submit: Hands an intent to the console.
        act: Has a tab's action done, from the server's thread; only enqueues.
    """

    def __init__(self, gui: viser.GuiApi, picture: ConsoleState, submit: Submit, act: Act):
        names = tuple(task.name for task in picture.tasks)
        self._several = len(names) > 1
        self._choice: viser.GuiDropdownHandle[str] = gui.add_dropdown("Task", names, visible=self._several)
        self._standings = Html(gui)

        @self._choice.on_update
        async def _(event: viser.GuiEvent[viser.GuiDropdownHandle[str]]) -> None:
            if event.client_id is not None:
                act(event.client_id, partial(submit, intents.Choose(event.target.value)))

    def draw(self, picture: ConsoleState) -> None:
        """Show the console's state."""
        if self._choice.value != picture.task.name:
            self._choice.value = picture.task.name
        if self._several:
            lines = "".join(map(_line, picture.tasks))
            self._standings.show(f'<div class="fh-tasks">{lines}</div>')


def _line(task: TaskStanding) -> str:
    return f"<div><b>{text(task.name)}</b> {element(f'standing-{task.name}', standing_words(task))}</div>"


def standing_words(task: TaskStanding) -> str:
    """Return how often a task was demonstrated, and whether the robot has the model."""
    n = task.n_demonstrations
    if not task.robot_does:
        return "not done by this robot"
    if not n:
        return "not taught"
    robot = (
        "on its way"
        if task.sending
        else "asking the robot"
        if task.asking
        else "robot lacks it"
        if task.differs
        else "robot has it"
    )
    return f"{n} demo{'' if n == 1 else 's'}, {robot}"
