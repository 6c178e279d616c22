"""A link inside one process: one robot's end, and an end for each operator; messages arrive in the sender's call."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable

from farhand.common.link.interface import Answered, Deliver, Request
from farhand.common.wire.keys import Channel


class Question:
    """One that waits for its answer."""

    def __init__(self, data: bytes, answered: Answered):
        self.data = data
        self._answered = answered

    def answer(self, data: bytes) -> None:
        self._answered(data)


class _End:
    """What both ends have: subscribers, servers, and a list of all that was handed over, delivered or not."""

    def __init__(self) -> None:
        self.sent: list[tuple[Channel, bytes]] = []
        self.subscribers: dict[Channel, list[Deliver]] = defaultdict(list)
        self.servers: dict[Channel, Callable[[Request], bool | None]] = {}

    def subscribe(self, channel: Channel, deliver: Deliver) -> None:
        self.subscribers[channel].append(deliver)

    def serve(self, channel: Channel, handle: Callable[[Request], bool | None]) -> None:
        self.servers[channel] = handle

    def limit(self, channel: Channel, bytes_per_s: float) -> None:
        """Everything arrives at once: there is nothing to save."""

    def hear(self, channel: Channel, data: bytes) -> None:
        for deliver in self.subscribers[channel]:
            deliver(data)


class RobotsEnd(_End):
    """The robot's end, which every operator's end is joined to."""

    def __init__(self) -> None:
        super().__init__()
        self.operators: list[OperatorsEnd] = []

    def send(self, channel: Channel, data: bytes) -> None:
        self.sent.append((channel, data))
        for end in self.operators:
            end.carry(lambda end=end: end.hear(channel, data), back=True)

    def ask(self, channel: Channel, data: bytes, timeout_s: float, answered: Answered) -> None:
        raise AssertionError("the robot asks nobody")

    def forget(self) -> None:
        """Forget who listens and serves here: the robot's process has ended."""
        self.subscribers.clear()
        self.servers.clear()

    def cut(self) -> None:
        """Let nothing through any more, in either direction."""
        for end in self.operators:
            end.cut()

    def mend(self) -> None:
        for end in self.operators:
            end.mend()

    def close(self) -> None:
        self.cut()


class OperatorsEnd(_End):
    """One operator's end. Stalled everything waits, deaf what the robot says waits, cut everything is lost."""

    def __init__(self, robot: RobotsEnd | None = None) -> None:
        super().__init__()
        self._robot = robot or RobotsEnd()
        self._robot.operators.append(self)
        self._waiting: list[Callable[[], object]] = []
        self.asked: list[tuple[Channel, bytes]] = []
        """All questions that were handed over here, answered or not."""
        self.stalled = self.deaf = self.is_cut = False

    def carry(self, arrive: Callable[[], object], back: bool = False) -> None:
        if self.stalled or (back and self.deaf):
            self._waiting.append(arrive)
        elif not self.is_cut:
            arrive()

    def cut(self) -> None:
        self.is_cut = True

    def mend(self) -> None:
        """Deliver at once what waited."""
        self.stalled = self.deaf = self.is_cut = False
        waiting, self._waiting = self._waiting, []
        for arrive in waiting:
            arrive()

    def send(self, channel: Channel, data: bytes) -> None:
        self.sent.append((channel, data))
        self.carry(lambda: self._robot.hear(channel, data))

    def ask(self, channel: Channel, data: bytes, timeout_s: float, answered: Answered) -> None:
        self.asked.append((channel, data))
        handle = self._robot.servers.get(channel)
        if handle is None or self.is_cut:
            answered(None)
            return
        back = Question(data, lambda answer: self.carry(lambda: answered(answer), back=True))
        self.carry(lambda: self._robot.servers[channel](back))

    def close(self) -> None:
        self.cut()


def joined() -> tuple[RobotsEnd, OperatorsEnd]:
    """A robot's end, and the end of its only operator."""
    robot = RobotsEnd()
    return robot, OperatorsEnd(robot)
