"""Sending of models to the robot: one task's, each task's, or every changed one."""

from __future__ import annotations

from functools import partial

from farhand.local_site.console import intents
from farhand.local_site.exchange.model_sender import ModelSender
from farhand.local_site.exchange.notices import Tell
from farhand.local_site.teaching.lesson import LearnedModel
from farhand.local_site.teaching.library import Library


class Sending:
    """Executor of the operator's intents about sending, which reports the outcome.

    Used by the console's thread alone.

    Args:
        library: Lessons of all tasks.
        models: Sends the models one after the other.
        tell: Tells the operator.
    """

    def __init__(self, library: Library, models: ModelSender, tell: Tell):
        self._library, self._models, self._tell = library, models, tell
        self._outcomes: dict[str, tuple[str, bool] | None] = {}
        self._robot_tasks: tuple[str, ...] = ()
        self._asked_boot = ""
        self.by_itself = False
        """True if a model is sent whenever it changes."""

    @property
    def sending_library(self) -> bool:
        """True while a part of the library is still being sent."""
        return None in self._outcomes.values()

    def do(self, intent: intents.Send) -> None:
        """Execute an intent that is possible now."""
        match intent:
            case intents.SendModel():
                self._send_chosen()
            case intents.SendLibrary():
                self._send_library()
            case intents.AutoSend(on):
                self.by_itself = on

    def robot_does(self, name: str) -> bool:
        """Decide whether the robot has a task; True while its tasks are unknown."""
        return not self._robot_tasks or name in self._robot_tasks

    def ask_what_it_has(self, boot: str) -> None:
        """Ask the robot, once per boot, which of the models it has: this site may have been restarted.

        Args:
            boot: Boot id of the robot.
        """
        if boot != self._asked_boot:
            self._asked_boot = boot
            for name, learned in self._library.learned.items():
                if self.robot_does(name):
                    self._models.ask_whether_it_has(name, learned)

    def tick(self, robot_tasks: tuple[str, ...]) -> None:
        """Send changed models, if the operator chose so.

        Args:
            robot_tasks: Names of the robot's tasks; empty before its first answer.
        """
        if robot_tasks != self._robot_tasks:
            self._robot_tasks = robot_tasks
            for name in self._library.by_task:
                if not self.robot_does(name):
                    self._tell("task", self._not_done(name), good=False)
        if self.by_itself:
            for name, learned in self._library.learned.items():
                if learned.sha256 != self._models.newest_sha256(name) and self.robot_does(name):
                    self._send(name, learned)

    def _not_done(self, name: str) -> str:
        return f"this robot does not do {name}, only {' and '.join(self._robot_tasks)}"

    def _send_chosen(self) -> None:
        learned = self._library.chosen.learned
        assert learned is not None, "nothing is sent where nothing was taught"
        self._send(self._library.task.name, learned)

    def _send(self, name: str, learned: LearnedModel) -> None:
        about = f"{name}, model {learned.sha256[:8]}"
        self._models.send(
            name, learned, lambda text, good: self._tell("send model", f"{about}: {text}", good)
        )  # fmt: skip

    def _send_library(self) -> None:
        """Send each model in turn.

        The robot is asked for each by its hash, so only differing ones are sent.
        """
        learned = self._library.learned
        self._outcomes = dict.fromkeys(learned)
        for name, model in learned.items():
            if self.robot_does(name):
                self._models.send(name, model, partial(self._on_settled, name), ask_first=True)
            else:
                self._on_settled(name, "this robot does not do it", False)

    def _on_settled(self, name: str, text: str, good: bool) -> None:
        self._outcomes[name] = text, good
        settled = {each: outcome for each, outcome in self._outcomes.items() if outcome is not None}
        if not self.sending_library:
            words = "; ".join(f"{each}: {said}" for each, (said, _) in settled.items())
            self._tell("send library", words, all(fine for _, fine in settled.values()))
