"""Motions that the robot recorded while this site drove it: fetched, and learned like any demonstration."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from farhand.common.errors import FarhandError
from farhand.common.mode_table import Action
from farhand.common.wire.messages import Event, EventKind, RecordingOffer
from farhand.common.wire.motion_encoding import RecordedMotion
from farhand.local_site.console import intents
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.exchange.fetching import BlobFetcher
from farhand.local_site.exchange.notices import Tell
from farhand.local_site.teaching.demonstration import Demonstration
from farhand.local_site.teaching.library import Library
from farhand.local_site.teaching.teaching_permission import NotNow

_SOURCE = "driven; recorded by the robot as "
"""Beginning of the source of a demonstration that the robot recorded; the hash follows."""


class RobotRecordings:
    """Learner of the robot's recordings: of those of this process at once, of earlier ones by Recover.

    Used by the console's thread alone.

    Args:
        fetcher: Fetches the recordings.
        library: Learns each recording into its task.
        site_name: Name of this site.
        tell: Tells the operator.
    """

    def __init__(self, fetcher: BlobFetcher, library: Library, site_name: str, tell: Tell):
        self._fetcher, self._library = fetcher, library
        self._site_name, self._tell = site_name, tell
        self._expected = False  # recording begun by this process, to be learned
        self._ended = False  # the catalogue holds it by now
        self._done: set[str] = set()
        self._offers: tuple[RecordingOffer, ...] = ()
        self._fetching, self._to_fetch = "", list[str]()
        self._arrived: tuple[str, bytes] | None = None

    @property
    def fetching(self) -> float | None:
        """Share of the fetched recording that has arrived, from 0 to 1; None while none is fetched."""
        if self._ended:
            return 0.0
        return self._fetcher.share(self._fetching) if self._fetching else None

    @property
    def can_recover(self) -> bool:
        """True if the robot has a recording of this site that was not learned."""
        return self._newest is not None and self.fetching is None

    def action_for(self, intent: intents.Intent, state: ConsoleState) -> Action | None:
        """Return the action of the robot for an intent about its recording; None for any other intent."""
        match intent:
            case intents.RecordDemonstration() if state.coupled:
                self._expected = True
                return Action.RECORD
            case intents.EndDemonstration() if state.robot_records:
                return Action.END_RECORDING
            case intents.Undo() if state.robot_records:
                self._expected = False
                return Action.END_RECORDING
        return None

    def on_event(self, event: Event) -> bool:
        """Process an event of the robot; return whether its catalogue has changed for this site."""
        if event.kind != EventKind.RECORDED or event.who != self._site_name:
            return False
        self._ended = self._expected and event.succeeded
        self._expected = False
        return True

    def on_restart(self) -> None:
        """Forget the robot's recordings: it was restarted, and they are gone."""
        if self._expected or self._ended or self._newest is not None:
            self._tell("record", "the robot was restarted: its recordings are lost", good=False)
        self._expected = self._ended = False
        self._offers = ()
        self._to_fetch.clear()

    def on_offers(self, offers: Sequence[RecordingOffer]) -> None:
        """Process the robot's list of recordings."""
        taught, known = self._library.by_task.values(), self._offers
        learned = {each.source.removeprefix(_SOURCE) for task in taught for each in task.demonstrations}
        self._offers = tuple(
            o for o in offers if o.site_name == self._site_name and o.sha256 not in learned
        )  # fmt: skip
        if self._ended and (new := [o.sha256 for o in self._offers if o not in known]):
            self._to_fetch.append(new[-1])
        self._ended = False
        self._fetch_next()

    def recover(self) -> None:
        """Fetch and learn the newest recording that was not learned."""
        offer = self._newest
        assert offer is not None and self.fetching is None, "recovered only when `can_recover`"
        self._to_fetch.append(offer.sha256)
        self._fetch_next()

    def learn_arrived(self) -> None:
        """Learn an arrived recording, unless another demonstration is being made."""
        if self._arrived is None or self._library.recording:
            return
        (sha256, content), self._arrived = self._arrived, None
        self._fetch_next()
        try:
            learned = self._learn(content, sha256)
        except FarhandError as error:
            self._tell("record", f"the robot's recording was not learned: {error}", good=False)
        else:
            self._tell("record", f"learned the robot's recording: {learned}")

    def _learn(self, content: bytes, sha256: str) -> str:
        """Learn a recorded motion into its task; return the task and its number of components, in words.

        Raises:
            FarhandError: When the motion is malformed, of an unknown task, or cannot be learned.
        """
        motion = RecordedMotion.from_bytes(content)
        task, taught = self._library.tasks.get(motion.task), self._library.by_task.get(motion.task)
        if (
            task is None
            or taught is None
            or (motion.frame_names, motion.space) != (task.frame_names, task.space)
        ):
            raise NotNow(f"its task {motion.task!r} is not taught here")
        taught.learn([_demonstration(motion, sha256)])
        assert taught.learned is not None
        return f"{task.name}, {taught.learned.model.n_components} components"

    @property
    def _newest(self) -> RecordingOffer | None:
        taken = {*self._done, *self._to_fetch, self._fetching}
        return next((o for o in reversed(self._offers) if o.sha256 not in taken), None)

    def _on_content(self, sha256: str, content: bytes | None) -> None:
        self._fetching = ""
        if content is None:
            self._tell("record", "the robot's recording could not be fetched", good=False)
        else:
            self._arrived = sha256, content
            self._done.add(sha256)
            self.learn_arrived()
        self._fetch_next()

    def _fetch_next(self) -> None:
        if self._to_fetch and not self._fetching and self._arrived is None:
            self._fetching = self._to_fetch.pop(0)
            self._fetcher.fetch(self._fetching, partial(self._on_content, self._fetching))


def _demonstration(motion: RecordedMotion, sha256: str) -> Demonstration:
    samples = motion.samples()
    points, D = samples.points, motion.n_dims
    return Demonstration(
        time_s=samples.time_s,
        position_m=points[:, :D],
        quat_wxyz=points[:, D:] if motion.oriented else None,
        frame_origin_m=samples.frame_origin_m,
        frame_rotation=samples.frame_rotation,
        frame_names=motion.frame_names,
        source=_SOURCE + sha256,
    )
