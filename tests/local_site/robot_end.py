"""The robot's end of a link, by script: what it is sent is kept, what it says is the test's to say."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from farhand.common.configuration import load_toml
from farhand.common.link.interface import Request
from farhand.common.mode_table import ControlMode, Phase, mode_after
from farhand.common.task import AnyTask, ArmTask, PointTask, TaskSet
from farhand.common.wire import keys
from farhand.common.wire.codec import decode, encode
from farhand.common.wire.keys import Channel
from farhand.common.wire.messages import (
    Command,
    CommandReply,
    Event,
    ExecutionReport,
    Heartbeat,
    LeaseReply,
    LeaseRequest,
    Message,
    ModelReply,
    ModelTransfer,
    MoveTarget,
    OperatorInput,
    ReportRequest,
    Stamp,
    Stop,
    Telemetry,
)
from farhand.common.wire.reasons import Reason, in_words
from farhand.local_site.console.console import Console
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.teaching.library import Library
from farhand.local_site.teaching.samples import still_frames
from farhand.local_site.workcell.workcell import Workcell, make_workcell
from tests.cells import JACO
from tests.loopback import OperatorsEnd, RobotsEnd, joined

TASK = load_toml(Path(__file__).parents[2] / "deploy" / "tasks" / "planar.toml", PointTask)
FRAMES = still_frames(TASK)
HOT_STAB = load_toml(Path(__file__).parents[2] / "deploy" / "tasks" / "hot-stab.toml", ArmTask)
PATIENCE_S = 60.0
LEASE_ID = "abcd0123"

M = TypeVar("M", bound=Message)


class RobotEnd:
    """Answers at once: grants the lease, accepts commands and models, unless told to refuse."""

    def __init__(self, link: RobotsEnd):
        self._link = link
        self.boot, self.mode = "boot", ControlMode.DISARMED
        self.tasks: tuple[str, ...] = (TASK.name,)
        self.models: set[str] = set()
        self.refusal: Reason | None = None
        self.lease_refusal: Reason | None = None
        self.on_command: Callable[[Command], None] = lambda command: None
        self._t_ns = self._seq = 0
        self.measured = ExecutionReport(stamp=self.now())
        """Its answer to who asks what it measured."""
        self._heard: list[Message] = []
        self._changed = threading.Condition()
        link.serve(keys.LEASE, self._serving(LeaseRequest, self._on_lease))
        link.serve(keys.COMMAND, self._serving(Command, self._on_command))
        link.serve(keys.MODEL, self._serving(ModelTransfer, self._on_model))
        link.serve(keys.REPORT, self._serving(ReportRequest, lambda _: self.measured))
        for channel, kind in (
            (keys.STOP, Stop),
            (keys.INPUT, OperatorInput),
            (keys.TARGET, MoveTarget),
            (keys.HEARTBEAT, Heartbeat),
        ):
            link.subscribe(channel, lambda data, kind=kind: self._keep(decode(data, kind)))

    def heard(self, kind: type[M]) -> list[M]:
        with self._changed:
            return [message for message in self._heard if isinstance(message, kind)]

    def wait_for(self, kind: type[M], count: int = 1) -> list[M]:
        """The messages of a kind, once there are so many."""
        with self._changed:
            assert self._changed.wait_for(
                lambda: sum(isinstance(m, kind) for m in self._heard) >= count, PATIENCE_S
            )
        return self.heard(kind)

    def now(self) -> Stamp:
        self._t_ns += 1_000_000
        return Stamp(self.boot, self._t_ns)

    def report(self, mode: ControlMode | None = None, **fields: Any) -> Telemetry:
        """Say where the robot is."""
        with self._changed:
            self.mode = mode or self.mode
            self._seq += 1
            usual: dict[str, Any] = {
                "seq": self._seq, "stamp": self.now(), "mode": self.mode, "position_m": (0.5, 0.5),
                "frame_origin_m": (0.7, 0.3), "lease": LEASE_ID[:4],
            }  # fmt: skip
        report = Telemetry(**(usual | fields))
        self.say(keys.TELEMETRY, report)
        return report

    @contextmanager
    def reporting(self) -> Iterator[None]:
        """Say it again and again, as a robot does: what is told once is old after some seconds."""
        ended = threading.Event()

        def report() -> None:
            while not ended.wait(0.1):
                self.report()

        thread = threading.Thread(target=report)
        thread.start()
        try:
            yield
        finally:
            ended.set()
            thread.join()

    def event(self, kind: str, text: str, **fields: Any) -> None:
        self._seq += 1
        self.say(keys.EVENT, Event(seq=self._seq, stamp=self.now(), kind=kind, reason=in_words(text), mode=self.mode, **fields))  # fmt: skip

    def say(self, channel: Channel, message: Message) -> None:
        self._link.send(channel, encode(message))

    def restart(self) -> None:
        """Another process life of the robot."""
        self.boot, self.mode, self._t_ns, self._seq = self.boot + "'", ControlMode.DISARMED, 0, 0
        self.models.clear()

    def _serving(self, kind: type[M], answer: Callable[[M], Message]) -> Callable[[Request], None]:
        def serve(request: Request) -> None:
            message = decode(request.data, kind)
            self._keep(message)
            request.answer(encode(answer(message)))

        return serve

    def _keep(self, message: Message) -> None:
        with self._changed:
            self._heard.append(message)
            self._changed.notify_all()

    def _on_lease(self, request: LeaseRequest) -> LeaseReply:
        why = self.lease_refusal
        return LeaseReply(
            granted=not why, lease_id="" if why else LEASE_ID, holder=request.site_name, reason=why,
            stamp=self.now(), tasks=self.tasks, n_dims=2,
        )  # fmt: skip

    def _on_command(self, command: Command) -> CommandReply:
        after = mode_after(self.mode, Phase.NONE, command.action)
        if not self.refusal and after is not None:
            self.mode = after
        self.on_command(command)
        return CommandReply(
            command_id=command.command_id, accepted=not self.refusal, reason=self.refusal,
            mode=self.mode, stamp=self.now(),
        )  # fmt: skip

    def _on_model(self, transfer: ModelTransfer) -> ModelReply:
        complete = bool(transfer.content) or transfer.sha256 in self.models
        if complete and not self.refusal:
            self.models.add(transfer.sha256)
        return ModelReply(
            accepted=not self.refusal,
            sha256=transfer.sha256,
            complete=complete,
            reason=self.refusal,
            stamp=self.now(),
        )


class Desk:
    """A running console, its library, and the robot's end."""

    def __init__(self, console: Console, library: Library, robot: RobotEnd, link: OperatorsEnd):
        self.console, self.library, self.robot, self.link = console, library, robot, link

    @property
    def picture(self) -> ConsoleState:
        return self.console.picture

    def until(self, holds: Callable[[ConsoleState], bool]) -> ConsoleState:
        assert self.console.wait_for(holds, PATIENCE_S), [n.text for n in self.picture.notices]
        return self.picture

    def told(self, words: str) -> ConsoleState:
        """Wait until the operator was told something."""
        return self.until(lambda p: any(words in f"{n.what}: {n.text}" for n in p.notices))

    def connected(self, mode: ControlMode = ControlMode.DISARMED, **fields: Any) -> Desk:
        """The robot has reported, and this site is in control."""
        self.robot.wait_for(LeaseRequest)
        report = self.robot.report(mode, **fields)
        self.until(lambda p: p.robot is not None and p.robot.stamp == report.stamp and p.in_control)
        return self


@contextmanager
def desk(data_dir: Path, *tasks: AnyTask, place: Workcell | None = None) -> Iterator[Desk]:
    """A console on a link in memory, of the planar task unless told otherwise."""
    remote, local = joined()
    robot, library = RobotEnd(remote), Library(TaskSet(tasks or (TASK,)), data_dir)
    robot.tasks = library.tasks.names
    console = Console(library, local, "ann", place=place or make_workcell(library.task, JACO))
    console.start()
    try:
        yield Desk(console, library, robot, local)
    finally:
        console.close()


def stroke(n: int = 60) -> tuple[np.ndarray, np.ndarray]:
    """Positions (n, 2) [m] and times (n,) [s] of a plain motion into the target."""
    part = np.linspace(0.0, 1.0, n)[:, None]
    start, end = np.array(TASK.start_m), np.array(TASK.target.origin_m)
    return start + (3 * part**2 - 2 * part**3) * (end - start), 0.03 * np.arange(n)
