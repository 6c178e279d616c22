"""The site asks for pictures while the page shows them, tells how late they come, and keeps the newest."""

from __future__ import annotations

import pytest

from farhand.common.link.interface import Request
from farhand.common.mode_table import ControlMode
from farhand.common.wire import keys
from farhand.common.wire.codec import decode, encode
from farhand.common.wire.messages import CameraPicture, CameraReply, CameraRequest, Stamp, Telemetry
from farhand.common.wire.reason_words import sentence
from farhand.common.wire.reasons import Code, Reason, because
from farhand.local_site.exchange.camera import CameraWatch
from farhand.local_site.exchange.report_age import LinkMonitor
from farhand.local_site.exchange.requests import Requests
from tests.loopback import OperatorsEnd, RobotsEnd

JPEG = b"\xff\xd8\xff rest"


class Bench:
    def __init__(self) -> None:
        remote = RobotsEnd()
        local = OperatorsEnd(remote)
        self.now_s, self.link, self.monitor = 0.0, local, LinkMonitor()
        self.inquiries = Requests(local, lambda job: job(), lambda: self.now_s)
        self.watch = CameraWatch(self.inquiries, self.monitor, "me", lambda: self.now_s)
        self.asked: list[CameraRequest] = []
        self.reason: Reason | None = None
        remote.serve(keys.CAMERA, self._answer)
        self.report()

    def _answer(self, request: Request) -> None:
        self.asked.append(decode(request.data, CameraRequest))
        sends = self.reason is None or self.reason.code == Code.CAMERA_STARTS
        request.answer(encode(CameraReply(sends=sends, reason=self.reason, stamp=Stamp("boot", 1))))

    def report(self, boot: str = "boot") -> None:
        """The robot's clock is 100 s ahead, and a report takes 0.3 s."""
        t_ns = round(1e9 * (self.now_s + 100.0 - 0.3))
        report = Telemetry(
            seq=1 + round(20 * self.now_s), stamp=Stamp(boot, t_ns), mode=ControlMode.HOLD, position_m=(0.0, 0.0, 0.0),
            frame_origin_m=(0.0, 0.0, 0.0),
        )  # fmt: skip
        self.monitor.received(report, self.now_s)
        self.watch.on_report(report)

    def run(self, seconds: float, reporting: bool = True) -> None:
        for _ in range(round(20 * seconds)):
            self.now_s += 0.05
            if reporting:
                self.report()
            self.inquiries.tick(self.now_s)
            self.watch.tick()

    def picture(
        self, seq: int, way_s: float = 0.3, jpeg: bytes = JPEG, boot: str = "boot", taken_s: float = 0.0
    ) -> None:
        t_ns = round(1e9 * (self.now_s + 100.0 - way_s - taken_s))
        picture = CameraPicture(
            seq=seq, stamp=Stamp(boot, t_ns), width_px=320, height_px=240, jpeg=jpeg, taken_s=taken_s
        )
        self.watch.on_picture(picture)


@pytest.fixture
def bench() -> Bench:
    bench = Bench()
    bench.watch.want(True)
    return bench


def test_nothing_is_asked_until_the_page_shows_the_pictures():
    bench = Bench()
    bench.run(10.0)
    bench.picture(1)
    assert not bench.asked and bench.watch.state.picture is None


def test_it_is_asked_once_a_second_and_told_how_late_the_pictures_came(bench: Bench):
    bench.run(5.0)
    assert 4 <= len(bench.asked) <= 6 and {request.late_s for request in bench.asked} == {0.0}
    bench.picture(1, way_s=0.5)
    bench.picture(2, way_s=1.0)
    bench.picture(3, way_s=0.4)
    bench.run(1.1)
    assert bench.asked[-1].late_s == pytest.approx(0.7)
    bench.run(1.1)
    assert bench.asked[-1].late_s == 0.0


def test_a_slow_camera_is_not_taken_for_a_slow_link(bench: Bench):
    bench.run(2.0)
    bench.picture(1, taken_s=3.0)
    bench.run(1.1)
    assert bench.asked[-1].late_s == pytest.approx(0.0, abs=1e-6)


def test_a_robot_that_sends_none_is_asked_rarely(bench: Bench):
    bench.reason = because(Code.LINK_NARROW, rate_kbps=9.6, least_kbps=30.0)
    bench.run(30.0)
    assert len(bench.asked) == 2
    assert "pictures need 30" in sentence(bench.watch.state.why) and bench.watch.state.is_there


def test_nothing_is_asked_into_an_outage(bench: Bench):
    bench.run(2.0)
    n_asked = len(bench.asked)
    bench.run(20.0, reporting=False)
    assert len(bench.asked) <= n_asked + 2
    bench.run(1.1)
    assert len(bench.asked) > n_asked


def test_only_newer_jpeg_files_of_this_boot_are_shown(bench: Bench):
    bench.picture(5)
    shown = bench.watch.state.picture
    assert shown is not None and shown.seq == 5 and bench.watch.state.is_there
    bench.picture(5)
    bench.picture(4)
    bench.picture(6, jpeg=b"<svg onload=alert(1)>")
    bench.picture(7, boot="another")
    assert bench.watch.state.picture is shown
    bench.report("another")
    assert bench.watch.state.picture is None
    bench.picture(1, boot="another")
    assert bench.watch.state.picture is not None


def test_a_robot_without_a_camera_is_known_and_hidden_pictures_are_forgotten(bench: Bench):
    bench.picture(1)
    bench.watch.want(False)
    assert bench.watch.state.picture is None and not bench.watch.state.wanted
    bench.watch.want(True)
    bench.reason = because(Code.NO_CAMERA)
    bench.run(0.2)
    assert not bench.watch.state.is_there


def test_a_state_that_says_the_same_is_the_same_so_that_the_page_is_not_drawn(bench: Bench):
    bench.reason = because(Code.CAMERA_STARTS)
    bench.run(1.5)
    before = bench.watch.state
    bench.run(3.0)
    assert bench.watch.state is before
