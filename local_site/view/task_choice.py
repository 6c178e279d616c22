"""The choice of the task that is taught, previewed and executed, and how it stands with each."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import viser

from local_site import intents
from local_site.picture import Picture, TaskStanding

Submit = Callable[[intents.Intent], None]
Act = Callable[[int, Callable[[], None]], None]


class TaskChoice:
    """It shows what the console has chosen, not what was clicked; hidden where there is nothing to choose.

    Args:
        gui: Of the server.
        picture: What the console shows at first.
        submit: Hands an intent to the console.
        act: Has something done for a tab, from the server's thread; only enqueues.
    """

    def __init__(self, gui: viser.GuiApi, picture: Picture, submit: Submit, act: Act):
        labels = tuple(map(_label, picture.tasks))
        self._choice: viser.GuiDropdownHandle[str] = gui.add_dropdown("Task", labels, visible=len(labels) > 1)

        @self._choice.on_update
        async def _(event: viser.GuiEvent[viser.GuiDropdownHandle[str]]) -> None:
            if event.client_id is not None:
                name = event.target.value.partition(":")[0]
                act(event.client_id, partial(submit, intents.Choose(name)))

    def draw(self, picture: Picture) -> None:
        """Show what is so."""
        labels = tuple(map(_label, picture.tasks))
        if self._choice.options != labels:
            self._choice.options = labels
        (chosen,) = (
            label for task, label in zip(picture.tasks, labels, strict=True) if task.name == picture.task.name
        )
        if self._choice.value != chosen:
            self._choice.value = chosen


def _label(task: TaskStanding) -> str:
    n = task.n_demonstrations
    if not n:
        return f"{task.name}: not taught"
    robot = "on its way" if task.sending else "robot lacks it" if task.differs else "robot has it"
    return f"{task.name}: {n} demonstration{'' if n == 1 else 's'}, {robot}"
