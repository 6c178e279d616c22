"""The operator's console: every intent and every report goes through one queue with one owner.

It shows what the robot reported, never what it expects: an action stays pending until the robot's own
report settles it.
"""

from __future__ import annotations

import queue
import threading
import time
from collections import deque
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from common import keys
from common.codec import decode
from common.control_mode import Action
from common.errors import FarhandError, InvalidMessage
from common.keys import Channel
from common.link import Link
from common.link_monitor import LinkMonitor
from common.log import loop_logger
from common.messages import Event, ExecutionReport, Message, PlannedPath, ReportRequest, StopAck, Telemetry
from common.task import Task
from local_site import intents
from local_site.command_check import check
from local_site.commanding import Commanding
from local_site.inquiries import Inquiries
from local_site.model_sender import ModelSender
from local_site.picture import Notice, Picture
from local_site.samples import sample_strokes
from local_site.stop_sender import StopSender
from local_site.task_library import NotNow, TaskLibrary
from local_site.teleoperation import Teleoperation

_log = loop_logger(__name__)

_PERIOD_S = 0.05
_NOTICES = 200


class Console:
    """Owner of everything that the operator's site knows and asks.

    Args:
        task: What is taught and done.
        library: Demonstrations and models.
        link: To the robot.
        site_name: This place.
    """

    def __init__(self, task: Task, library: TaskLibrary, link: Link, site_name: str):
        self._task, self._library, self._link = task, library, link
        self._queue: queue.SimpleQueue[Callable[[], None] | None] = queue.SimpleQueue()
        self._notices: deque[Notice] = deque(maxlen=_NOTICES)
        self._monitor = LinkMonitor()
        self._inquiries = Inquiries(link)
        self._commanding = Commanding(
            link, self._inquiries, self._monitor, site_name, self._queue.put, self._notices.append
        )
        self._models = ModelSender(
            self._inquiries, task.name, self._queue.put, self._notices.append, time.monotonic
        )  # fmt: skip
        self._stop = StopSender(link, site_name)
        self._teleoperation = Teleoperation(link)
        self._robot: Telemetry | None = None
        self._path: PlannedPath | None = None
        self._path_received_s, self._plan_id = 0.0, 0
        self._changed = threading.Condition()
        self.picture = self._draw(time.monotonic())
        self._thread = threading.Thread(target=self._run, name="console", daemon=True)

    # From other threads -------------------------------------------------------------------------

    def start(self) -> None:
        """Listen to the robot and begin."""
        self._listen(keys.TELEMETRY, Telemetry, self._on_telemetry)
        self._listen(keys.EVENT, Event, self._on_event)
        self._listen(keys.PATH, PlannedPath, self._on_path)
        self._listen(keys.STOP_ACK, StopAck, self._stop.acknowledged)
        self._thread.start()

    def close(self) -> None:
        """End the console; what was not sent is not sent."""
        self._queue.put(None)
        self._thread.join(timeout=5.0)
        self._inquiries.close()

    def submit(self, intent: intents.Intent) -> None:
        """Ask for something. Returns at once; the picture tells what became of it."""
        self._queue.put(partial(self._on_intent, intent))

    def ask_report(self, timeout_s: float = 15.0) -> ExecutionReport | None:
        """How the newest execution went, asked of the robot. None when no answer came."""
        return self._inquiries.ask_and_wait(keys.REPORT, ReportRequest(), ExecutionReport, timeout_s)

    def wait_for(self, holds: Callable[[Picture], bool], timeout_s: float) -> bool:
        """Wait until a picture has a property. False when it did not in time."""
        with self._changed:
            return self._changed.wait_for(lambda: holds(self.picture), timeout_s)

    def _listen(self, channel: Channel, kind: type[Message], handle: Callable[[Any], None]) -> None:
        def deliver(data: bytes) -> None:
            try:
                message = decode(data, kind)
            except InvalidMessage as error:
                _log.warning("dropped: %s", error)
            else:
                self._queue.put(partial(handle, message))

        self._link.subscribe(channel, deliver)

    # The owner ----------------------------------------------------------------------------------

    def _run(self) -> None:
        due_s = time.monotonic()
        while True:
            if (left_s := due_s - time.monotonic()) <= 0.0:
                due_s = time.monotonic() + _PERIOD_S
                job = self._tick
            else:
                try:
                    job = self._queue.get(timeout=left_s)
                except queue.Empty:
                    continue
            if job is None:
                return
            try:
                job()
            except Exception:
                # One bad message or intent must not take the operator's console away.
                _log.exception("the console could not do something")
            with self._changed:
                self.picture = self._draw(time.monotonic())
                self._changed.notify_all()

    def _tick(self) -> None:
        now_s = time.monotonic()
        self._stop.tick(now_s)
        self._commanding.tick(self._robot, now_s)

    def _on_intent(self, intent: intents.Intent) -> None:
        try:
            match intent:
                case intents.Command():
                    self._command(intent)
                case intents.Hand():
                    self._hand(intent)
                case intents.Record():
                    self._record()
                case intents.End():
                    learned = self._library.end()
                    self._tell("end", f"learned: {learned.model.n_components} components")
                case intents.Undo():
                    self._library.undo()
                    self._tell("undo", "the last demonstration was undone")
                case intents.LoadSamples():
                    self._library.learn(sample_strokes(self._task))
                    self._tell("samples", "the samples were learned")
                case intents.SendModel():
                    self._send_model()
                case intents.MoveTarget():
                    self._teleoperation.move_target(intent.position_m, self._commanding.lease_id)
        except FarhandError as error:
            what = intent.action if isinstance(intent, intents.Command) else type(intent).__name__.lower()
            self._tell(what, f"refused: {error}", good=False)

    # Intents ------------------------------------------------------------------------------------

    def _command(self, intent: intents.Command) -> None:
        action, now_s = intent.action, time.monotonic()
        if action is Action.STOP:
            self._stop.press(now_s)
            return
        check(intent, self._draw(now_s))
        assert self._robot is not None
        sha256 = self._models.confirmed_sha256
        self._commanding.command(action, self._robot, now_s, self._task.name, sha256, self._plan_id)

    def _record(self) -> None:
        if self.picture.coupled:
            raise NotNow("coupled: your hand drives the robot now; clutch first")
        self._library.record()
        self._tell("record", "recording a demonstration")

    def _hand(self, intent: intents.Hand) -> None:
        """The hand teaches, or drives the robot while coupled, or does nothing."""
        if self._library.recording:
            self._library.hand(np.array(intent.position_m), intent.time_s)
        elif self._robot is not None and self._robot.coupling_id and self._commanding.lease_id:
            self._teleoperation.hand(
                intent.position_m, intent.released, self._robot, self._commanding.lease_id
            )  # fmt: skip

    def _send_model(self) -> None:
        if self._library.learned is None:
            raise NotNow("nothing was learned yet: record a demonstration first")
        self._models.send(self._library.learned)

    # Reports of the robot -----------------------------------------------------------------------

    def _on_telemetry(self, report: Telemetry) -> None:
        if not self._monitor.received(report, time.monotonic()):
            return
        if self._robot is not None and report.stamp.boot != self._robot.stamp.boot:
            self._models.confirmed_sha256, self._plan_id, self._path = "", 0, None
            self._tell("restart", "the robot was restarted", good=False)
        self._robot = report
        self._commanding.on_report(report)

    def _on_event(self, event: Event) -> None:
        self._commanding.on_event(event, time.monotonic())

    def _on_path(self, path: PlannedPath) -> None:
        self._path, self._path_received_s = path, time.monotonic()
        self._plan_id = path.plan_id or self._plan_id

    # The picture --------------------------------------------------------------------------------

    def _tell(self, what: str, text: str, good: bool = True) -> None:
        self._notices.append(Notice(time.monotonic(), what, text, good))

    def _draw(self, now_s: float) -> Picture:
        library, commanding = self._library, self._commanding
        current = (np.array(library.current),) if library.recording and library.current else ()
        return Picture(
            now_s=now_s,
            robot=self._robot,
            link=self._monitor.view(now_s),
            in_control=commanding.in_control(self._robot),
            why_not_in_control=commanding.why_not_in_control,
            pending=dict(commanding.pending),
            notices=tuple(self._notices),
            recording=library.recording,
            n_demonstrations=len(library.strokes),
            can_undo=library.can_undo,
            learned=library.learned,
            forming=library.forming(),
            confirmed_sha256=self._models.confirmed_sha256,
            sending_model=self._models.sending,
            strokes=(*library.strokes, *current),
            path=self._path,
            path_received_s=self._path_received_s,
            plan_id=self._plan_id,
            stop=self._stop.status,
            command_round_trips_s=tuple(commanding.round_trips_s),
        )
