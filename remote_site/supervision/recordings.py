"""Recordings of the driven robot: begun and ended by command, ended with DIRECT, kept for operators to fetch.

The catalogue lists all that operators can fetch: the robot's drawing and its recordings.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from enum import Enum

from farhand.common.mode_table import Action, Cause, ControlMode, Guard
from farhand.common.task import TaskSet
from farhand.common.version import installed_version
from farhand.common.wire.messages import (
    BlobReply,
    BlobRequest,
    CatalogueReply,
    EventKind,
    RecordingOffer,
    Stamp,
)
from farhand.common.wire.packed import pack
from farhand.common.wire.reasons import Code, Reason, because
from farhand.remote_site.interface.sensing import Sensing
from farhand.remote_site.motion.motion import Motion
from farhand.remote_site.supervision.event_log import Events
from farhand.remote_site.supervision.lease import Lease
from farhand.remote_site.supervision.motion_recorder import MotionRecorder, Recorded

_MOST_RECORDINGS = 8


class Catalogue:
    """Catalogue of contents by their hash, for the life of the process; only the newest recordings are kept."""

    def __init__(self) -> None:
        self._scene_sha256 = self._sketch_sha256 = ""
        self._version = installed_version()
        self._recordings: tuple[RecordingOffer, ...] = ()
        self._contents: dict[str, bytes] = {}

    def show(self, scene: bytes, sketch: bytes = b"") -> None:
        """Offer the robot's drawing and its sketch, packed; see `farhand.common.wire.scene_description`."""
        self._scene_sha256 = self._keep(scene, pack(scene))
        self._sketch_sha256 = self._keep(sketch, pack(sketch)) if sketch else ""

    def offer(self, recorded: Recorded) -> None:
        """Offer a recording, and drop the oldest if there are too many."""
        sha256 = self._keep(recorded.motion.content, recorded.motion.content)
        offer = RecordingOffer(sha256, recorded.site_name, recorded.whole, recorded.duration_s)
        self._recordings = (*self._recordings, offer)
        for old in self._recordings[:-_MOST_RECORDINGS]:
            del self._contents[old.sha256]
        self._recordings = self._recordings[-_MOST_RECORDINGS:]

    def list(self, now: Stamp) -> CatalogueReply:
        """Return everything that can be fetched."""
        return CatalogueReply(
            scene_sha256=self._scene_sha256, sketch_sha256=self._sketch_sha256, recordings=self._recordings,
            version=self._version, stamp=now,
        )  # fmt: skip

    def part(self, request: BlobRequest, now: Stamp) -> BlobReply:
        """Return a part of a content."""
        content = self._contents.get(request.sha256, b"")
        part = content[request.offset : request.offset + request.n_bytes]
        return BlobReply(
            sha256=request.sha256, size=len(content), offset=request.offset, content=part, stamp=now
        )  # fmt: skip

    def _keep(self, content: bytes, travels: bytes) -> str:
        sha256 = hashlib.sha256(content).hexdigest()
        self._contents[sha256] = travels
        return sha256


class RecordingEnd(Enum):
    """End of a recording."""

    WHOLE = Code.RECORDED
    """The driving operator ended it: it is a demonstration."""
    INTERRUPTED = Code.RECORDING_INTERRUPTED
    """Something else ended it: it can be fetched, and the operator judges it."""
    INCOMPLETE = Code.RECORDING_INCOMPLETE
    """Samples are missing: it cannot be used."""


class Recordings:
    """Present recording, and the catalogue that keeps the ended ones.

    Args:
        tasks: Tasks of the robot.
        sensing: The newest measurements.
        motion: Mover of the robot.
        lease: Lease of its control, with the name of the driving site.
        events: Log of the robot's events.
        now: The present stamp.
    """

    def __init__(
        self,
        tasks: TaskSet,
        sensing: Sensing,
        motion: Motion,
        lease: Lease,
        events: Events,
        now: Callable[[], Stamp],
    ):
        self._tasks, self._motion, self._lease, self._events = tasks, motion, lease, events
        self._recorder = MotionRecorder(sensing, motion.embodiment.hardware.control_hz, now)
        self._who = ""
        self.catalogue = Catalogue()

    @property
    def recorded_s(self) -> float | None:
        """Duration of the present recording [s]; None without one."""
        return self._recorder.recorded_s if self._recorder.recording else None

    def run(self, action: Action, task_name: str) -> Reason | None:
        """Begin or end a recording for a task. Return the reason of a refusal, None if it was done."""
        recording = self._recorder.recording
        if action is Action.RECORD and not recording:
            task = self._tasks.get(task_name)
            if task is None:
                return self._tasks.refusal(task_name)
            self._who = self._lease.holder
            self._recorder.begin(self._who, task)
        elif action is Action.END_RECORDING and recording:
            self._end(RecordingEnd.WHOLE, because(Code.ENDED_BY, action=action))
        else:
            return because(Code.RECORDING_ALREADY if recording else Code.NOT_RECORDING)
        return None

    def sample(self) -> None:
        """Take a sample, if one is due; end a recording that cannot continue."""
        coupling = self._motion.coupling
        if self._recorder.recording and coupling is not None:
            why = self._recorder.sample(coupling)
            if why is not None:
                self._end(RecordingEnd.INCOMPLETE, why)

    def leave(self, cause: Cause, why: Reason) -> None:
        """End the recording, if any, because the robot is about to leave DIRECT.

        Args:
            cause: Cause of the transition.
            why: Its reason, for the event.
        """
        if self._recorder.recording:
            coupling = self._motion.coupling
            let_go = cause is Guard.COUPLING_ENDED and coupling is not None and coupling.released
            whole = let_go or cause in (Action.CLUTCH, Action.EXECUTE)
            self._end(RecordingEnd.WHOLE if whole else RecordingEnd.INTERRUPTED, why)

    def _end(self, ending: RecordingEnd, why: Reason) -> None:
        recorded = self._recorder.close(ending is RecordingEnd.WHOLE)
        if recorded is not None and ending is not RecordingEnd.INCOMPLETE:
            self.catalogue.offer(recorded)
        if recorded is None:
            said = because(Code.NOTHING_RECORDED)
        else:
            said = because(ending.value, recorded_s=recorded.duration_s)
        good = recorded is not None and ending is RecordingEnd.WHOLE
        self._events.tell(
            EventKind.RECORDED, said, ControlMode.DIRECT, cause=why, succeeded=good, who=self._who
        )  # fmt: skip
