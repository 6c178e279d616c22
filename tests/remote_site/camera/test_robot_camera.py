"""Whoever looks gets pictures of the present, with the time of their exposure, or the reason why there are none."""

from __future__ import annotations

import queue
import threading
from collections.abc import Iterator

import numpy as np
import pytest

from farhand.common.clock import BootClock
from farhand.common.mode_table import ControlMode
from farhand.common.wire import keys
from farhand.common.wire.codec import decode, encode
from farhand.common.wire.messages import CameraPicture, CameraReply, CameraRequest, Stamp, Telemetry
from farhand.remote_site.camera.picture_plan import CameraFailed
from farhand.remote_site.camera.process import Wanted
from farhand.remote_site.camera.robot_camera import RobotCamera, Shutter
from farhand.remote_site.camera.still import Still
from tests.loopback import OperatorsEnd, RobotsEnd
from tests.messages import said

MOUTH = np.array([0.8, 0.0, 0.4, 1.0, 0.0, 0.0, 0.0])


def a_report(t_ns: int = 1) -> Telemetry:
    return Telemetry(
        seq=1, stamp=Stamp("boot", t_ns), mode=ControlMode.HOLD, position_m=(0.1, 0.2, 0.3), frame_origin_m=(0.8, 0.0, 0.4)
    )  # fmt: skip


class Shutters:
    """Takes what it is told to: a picture, or a fault."""

    def __init__(self) -> None:
        self.wanted: queue.SimpleQueue[Wanted] = queue.SimpleQueue()
        self.fault: CameraFailed | None = None
        self.closed = threading.Event()

    def take(self, wanted: Wanted) -> Still:
        self.wanted.put(wanted)
        if self.fault is not None:
            raise self.fault
        return Still(b"\xff\xd8 a picture", 320, 240, None, 0.5)

    def interrupt(self) -> None:
        self.fault = CameraFailed("closed")

    def close(self) -> None:
        self.closed.set()


class Bench:
    def __init__(self, shutter: Shutter | None, rate_bps: float = 0.0):
        self.robot = RobotsEnd()
        self.operator = OperatorsEnd(self.robot)
        self.clock = BootClock("boot", lambda: 7_000_000_000)
        self.pictures: queue.SimpleQueue[CameraPicture] = queue.SimpleQueue()
        self.operator.subscribe(keys.PICTURE, lambda data: self.pictures.put(decode(data, CameraPicture)))
        self.camera = RobotCamera(self.robot, self.clock, rate_bps, shutter)
        self.camera.start()

    def ask(self) -> CameraReply:
        answers: list[bytes | None] = []
        self.operator.ask(keys.CAMERA, encode(CameraRequest(session="page")), 1.0, answers.append)
        assert answers[0] is not None
        return decode(answers[0], CameraReply)


@pytest.fixture
def shutter() -> Shutters:
    return Shutters()


@pytest.fixture
def bench(shutter: Shutters) -> Iterator[Bench]:
    bench = Bench(shutter)
    yield bench
    bench.camera.close()
    assert shutter.closed.is_set()


def test_a_site_that_looks_gets_pictures_of_the_newest_report(bench: Bench, shutter: Shutters):
    report = a_report(5_000_000_000)
    bench.camera.observe(report, MOUTH)
    first = bench.ask()
    assert first.sends and said(first) == "the camera starts"
    picture = bench.pictures.get(timeout=30.0)
    assert picture.jpeg == b"\xff\xd8 a picture" and (picture.width_px, picture.height_px) == (320, 240)
    assert picture.stamp == Stamp("boot", 4_500_000_000), "the simulation's time, less the image's age"
    assert picture.taken_s == 2.5
    assert shutter.wanted.get(timeout=30.0).truth == tuple(MOUTH)
    assert bench.pictures.get(timeout=30.0).seq == picture.seq + 1
    assert bench.ask() == CameraReply(sends=True, stamp=Stamp("boot", 7_000_000_000))


def test_a_camera_of_ones_own_has_the_time_at_which_it_was_asked(bench: Bench):
    bench.camera.observe(a_report(5_000_000_000), None)
    bench.ask()
    assert bench.pictures.get(timeout=30.0).stamp == Stamp("boot", 6_500_000_000)


def test_nothing_is_taken_before_anybody_asks_or_the_robot_has_reported(bench: Bench, shutter: Shutters):
    bench.ask()
    bench.camera.observe(a_report(), None)
    bench.ask()
    bench.pictures.get(timeout=30.0)
    assert shutter.wanted.get(timeout=30.0).most_bytes > 0

    other = Shutters()
    quiet = Bench(other)
    quiet.camera.observe(a_report(), None)
    quiet.camera.close()
    assert other.wanted.empty() and quiet.pictures.empty()


def test_a_fault_is_told_and_the_pictures_come_back(bench: Bench, shutter: Shutters):
    shutter.fault = CameraFailed("the cable is unplugged")
    bench.camera.observe(a_report(), None)
    bench.ask()
    shutter.wanted.get(timeout=30.0)
    while (reply := bench.ask()).reason is None or said(reply) == "the camera starts":
        pass
    assert reply.sends and said(reply) == "the cable is unplugged"
    shutter.fault = None
    assert bench.pictures.get(timeout=30.0).jpeg


def test_a_robot_without_a_camera_and_a_narrow_link_are_told_at_the_first_question():
    assert said(Bench(None).ask()) == "this robot has no camera"
    narrow = Bench(Shutters(), rate_bps=9600.0)
    reply = narrow.ask()
    assert not reply.sends and said(reply) == "the link carries 9.6 kbit/s, pictures need 30"
    narrow.camera.close()


def test_a_question_that_is_not_understood_is_not_answered(bench: Bench):
    answers: list[bytes | None] = []
    bench.operator.ask(keys.CAMERA, b"\x00", 1.0, answers.append)
    assert answers in ([], [None])
