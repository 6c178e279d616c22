"""Everything that is the local site's own: recording, undoing, sending what was learned."""

from __future__ import annotations

from collections.abc import Callable

from local_site import intents
from local_site.demonstration import Demonstration
from local_site.model_sender import ModelSender
from local_site.own_place import OwnPlace
from local_site.task_library import TaskLibrary
from local_site.taught import NotNow

Tell = Callable[[str, str], None]


class Teaching:
    """Does what the operator asks about demonstrations and models. Used by the console's thread alone.

    Args:
        library: Demonstrations and models.
        place: Where demonstrations are made.
        models: Sends them.
        tell: Tells the operator what was done.
    """

    def __init__(self, library: TaskLibrary, place: OwnPlace, models: ModelSender, tell: Tell):
        self._library, self._place, self._models, self._tell = library, place, models, tell
        self._had_control = False
        self.auto_send = False
        """Whether a model is sent whenever it changes."""

    @property
    def left_over(self) -> Demonstration | None:
        """A demonstration that was being recorded when it was rolled back, or its process ended."""
        return self._library.left_over

    def do(self, intent: intents.Teach) -> None:
        """Do one of them.

        Raises:
            NotNow: When it is not possible at this moment.
        """
        match intent:
            case intents.Record():
                self._library.record(self._place.frames)
                self._tell("record", "recording a demonstration")
            case intents.End():
                learned = self._library.end()
                self._tell("end", f"learned: {learned.model.n_components} components")
            case intents.Undo():
                self._library.undo()
                self._tell("undo", "the last demonstration was undone")
            case intents.LoadSamples():
                self._load_samples()
            case intents.Recover():
                self._library.recover()
                self._tell("recover", "the demonstration that was left over was learned")
            case intents.GoTo() | intents.StartAnew() | intents.Delete():
                self._go_back(intent)
            case intents.Renew(seed):
                self._renew(seed)
            case intents.SendModel():
                self._send()
            case intents.AutoSend(on):
                self.auto_send = on

    def watch(self, in_control: bool) -> None:
        """Roll a demonstration back when the control of the robot is lost."""
        if self._had_control and not in_control:
            self.roll_back("the control of the robot was lost")
        self._had_control = in_control

    def tick(self) -> None:
        """Send a model that has changed, if so chosen."""
        learned = self._library.learned
        if self.auto_send and learned is not None and learned.sha256 != self._models.newest_sha256:
            self._models.send(learned)

    def roll_back(self, why: str) -> None:
        """Forget a demonstration under way; the model is as before it, bit for bit."""
        if self._library.recording:
            self._library.set_aside()
            self._tell("recording", f"rolled back: {why}; what was recorded can be recovered")

    def _load_samples(self) -> None:
        samples = self._place.samples()
        if not samples:
            raise NotNow("no demonstrations come with this task")
        self._library.learn(samples)
        self._tell("samples", "the samples were learned")

    def _renew(self, seed: int | None) -> None:
        if self._library.recording:
            raise NotNow("a demonstration is being recorded: end or undo it first")
        self._place.renew(seed)
        self._tell("renew", "your arm is back at ready, and its receptacle elsewhere")

    def _go_back(self, intent: intents.GoTo | intents.StartAnew | intents.Delete) -> None:
        match intent:
            case intents.GoTo(number):
                self._library.go_to(number)
                self._tell("library", f"revision {number} counts now")
            case intents.StartAnew():
                self._library.start_anew()
                self._tell("library", "begun anew; what was taught before can be gone back to")
            case intents.Delete(number):
                self._library.delete(number)
                self._tell("library", f"revision {number} was deleted")

    def _send(self) -> None:
        if self._library.learned is None:
            raise NotNow("nothing was learned yet: record a demonstration first")
        self._models.send(self._library.learned)
