from __future__ import annotations

import queue
from collections.abc import Callable, Iterator

import pytest
from msgspec.structs import replace

from farhand.common.mode_table import Action, ControlMode
from farhand.common.wire.messages import (
    Command,
    Event,
    Heartbeat,
    LeaseReply,
    LeaseRequest,
    Stamp,
    Telemetry,
    Wish,
)
from farhand.common.wire.reason_words import PRESS_AGAIN, sentence
from farhand.common.wire.reasons import Code, because, in_words
from farhand.local_site.console.commanding import Commanding
from farhand.local_site.exchange.notices import Notice
from farhand.local_site.exchange.report_age import LinkMonitor
from farhand.local_site.exchange.requests import Requests
from tests.local_site.robot_end import LEASE_ID, PATIENCE_S, RobotEnd
from tests.loopback import joined


class Desk:
    """A `Commanding` on the test's own thread and in the test's own time."""

    def __init__(self) -> None:
        remote, self.link = joined()
        self.robot = RobotEnd(remote)
        self.jobs: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        self.notices: list[Notice] = []
        self.inquiries = Requests(self.link, self.jobs.put, lambda: 100.0, ask_timeout_s=1.0)
        self.monitor = LinkMonitor()
        self.commanding = Commanding(self.link, self.inquiries, self.monitor, "ann", self.notices.append)

    def settle(self) -> None:
        """Let the answer to one question arrive."""
        self.jobs.get(timeout=PATIENCE_S)()

    def report(self, mode: ControlMode = ControlMode.HOLD, lease: str = LEASE_ID[:4]) -> Telemetry:
        return Telemetry(
            seq=1, stamp=self.robot.now(), mode=mode, position_m=(0.5, 0.5), frame_origin_m=(0.7, 0.3),
            lease=lease,
        )  # fmt: skip

    def in_control(self) -> Commanding:
        self.commanding.tick(None, 100.0)
        self.settle()
        return self.commanding


@pytest.fixture
def desk() -> Iterator[Desk]:
    made = Desk()
    yield made
    made.inquiries.close()


def an_event(command_id: str, succeeded: bool = True) -> Event:
    kind = "completed" if succeeded else "failed"
    return Event(
        seq=1, stamp=Stamp("boot", 9), kind=kind, reason=in_words("words"), command_id=command_id,
        succeeded=succeeded, mode=ControlMode.HOLD,
    )  # fmt: skip


def test_heartbeats_go_out_ten_times_a_second_and_echo_what_was_shown(desk: Desk):
    desk.in_control()
    report = desk.report()
    before = len(desk.robot.heard(Heartbeat))
    for since_s, n_sent in ((0.11, 1), (0.17, 1), (0.22, 2), (0.31, 2), (0.33, 3)):
        desk.commanding.tick(report, 100.0 + since_s)
        assert len(desk.robot.heard(Heartbeat)) == before + n_sent
    beats = desk.robot.heard(Heartbeat)[before:]
    assert {beat.echo for beat in beats} == {report.stamp}
    assert [beat.seq for beat in beats] == list(range(beats[0].seq, beats[0].seq + len(beats)))


@pytest.mark.parametrize(("holder", "n_in_24_s"), [("", 96), ("bob", 2)])
def test_a_site_without_control_sends_heartbeats_rarely_and_most_rarely_while_another_has_it(
    desk: Desk, holder: str, n_in_24_s: int
):
    report = replace(desk.report(lease="else" if holder else ""), holder=holder)
    for n in range(480):
        desk.commanding.tick(report, 100.0 + 0.05 * n)
    assert len(desk.robot.heard(Heartbeat)) == pytest.approx(n_in_24_s, rel=0.25)


def test_a_mere_watcher_renews_rarely_and_at_once_when_it_wants_the_control(desk: Desk):
    desk.robot.lease_refusal = because(Code.WATCHING)
    desk.commanding.wish(Wish.WATCH)
    report = replace(desk.report(lease="else"), holder="bob")
    desk.commanding.tick(report, 100.0)
    desk.settle()
    before = len(desk.robot.heard(LeaseRequest))
    desk.commanding.tick(report, 111.9)
    assert len(desk.robot.heard(LeaseRequest)) == before
    desk.commanding.wish(Wish.ASK)
    desk.commanding.tick(report, 111.95)
    assert desk.robot.wait_for(LeaseRequest, before + 1)[-1].wish is Wish.ASK


def test_the_lease_is_asked_for_and_renewed_once_a_second(desk: Desk):
    for n in range(31):
        desk.commanding.tick(None, 100.0 + 0.1 * n)
    requests = desk.robot.wait_for(LeaseRequest, 3)
    assert 3 <= len(requests) <= 4
    assert {(r.session, r.site_name) for r in requests} == {(desk.commanding.session, "ann")}


def test_this_site_is_in_control_only_when_the_robot_itself_says_so(desk: Desk):
    assert not desk.commanding.in_control(desk.report(lease=""))
    commanding = desk.in_control()
    assert commanding.lease_id == LEASE_ID
    assert not commanding.in_control(None)
    assert not commanding.in_control(desk.report(lease="else"))
    assert commanding.in_control(desk.report())


def test_a_refused_lease_is_shown_in_the_robots_words(desk: Desk):
    desk.robot.lease_refusal = in_words("held by bob")
    commanding = desk.in_control()
    assert commanding.lease_id == "" and sentence(commanding.why_not_in_control) == "held by bob"


def test_an_older_answer_about_the_lease_does_not_replace_a_newer_one(desk: Desk):
    commanding = desk.in_control()
    older = LeaseReply(
        granted=False, lease_id="", holder="", reason=in_words("long ago"), stamp=Stamp("boot", 0), tasks=("planar",), n_dims=2
    )  # fmt: skip
    commanding._on_lease(older, 0.1)
    assert commanding.lease_id == LEASE_ID
    commanding._on_lease(LeaseReply(
        granted=False, lease_id="", holder="", reason=in_words("restarted"), stamp=Stamp("next boot", 0), tasks=("planar",),
        n_dims=2,
    ), 0.1)  # fmt: skip
    assert commanding.lease_id == ""


def test_a_command_is_pending_from_the_click_to_the_robots_report_of_its_end(desk: Desk):
    commanding = desk.in_control()
    report = desk.report(ControlMode.DISARMED)
    commanding.command(Action.ARM, report, 101.0, "planar", "f" * 64, 7)
    (command,) = desk.robot.wait_for(Command)
    assert (command.lease_id, command.session) == (LEASE_ID, commanding.session)
    assert (command.echo, command.task, command.plan_id) == (report.stamp, "planar", 7)
    assert commanding.pending[Action.ARM].accepted_ns is None
    desk.settle()
    assert commanding.pending[Action.ARM].accepted_ns is not None
    assert len(commanding.round_trips_s) == 1
    commanding.on_event(an_event("another"), 102.0)
    assert Action.ARM in commanding.pending
    commanding.on_event(an_event(command.command_id), 102.0)
    assert not commanding.pending


def test_a_report_of_the_mode_that_it_leads_to_settles_a_command_whose_event_was_lost(desk: Desk):
    commanding = desk.in_control()
    before = desk.report(ControlMode.HOLD)
    commanding.command(Action.ARM, before, 101.0)
    desk.settle()
    commanding.on_report(before)  # older than the robot's acceptance
    commanding.on_report(desk.report(ControlMode.DISARMED))
    assert Action.ARM in commanding.pending
    commanding.on_report(desk.report(ControlMode.HOLD))
    assert not commanding.pending


def test_an_event_that_waited_out_an_outage_before_any_newer_report_came_is_late_all_the_same(desk: Desk):
    for n in range(50):
        desk.monitor.received(
            replace(desk.report(), seq=n + 1, stamp=Stamp("boot", n * 40_000_000)), 100.0 + 0.04 * n
        )
    event = replace(an_event(""), stamp=Stamp("boot", 2_000_000_000))
    desk.commanding.on_event(event, 122.0)
    assert desk.notices[-1].late_s == pytest.approx(20.0)


def test_a_refusal_is_told_with_its_reason_and_measured_value(desk: Desk):
    commanding = desk.in_control()
    desk.robot.refusal = because(Code.TOO_OLD, age_s=2.5, limit_s=1.0, what="command")
    commanding.command(Action.ARM, desk.report(), 101.0)
    desk.settle()
    assert not commanding.pending and not commanding.round_trips_s
    notice = desk.notices[-1]
    assert (notice.what, notice.good, notice.measured) == (Action.ARM, False, 2.5)
    assert notice.code in PRESS_AGAIN and "too late" in notice.text


def test_an_event_that_comes_before_the_answer_settles_the_command_for_good(desk: Desk):
    commanding = desk.in_control()
    commanding.command(Action.ARM, desk.report(), 101.0)
    (command,) = desk.robot.wait_for(Command)
    commanding.on_event(an_event(command.command_id), 101.1)
    desk.settle()
    assert not commanding.pending


def test_what_never_ends_is_given_up_with_a_word(desk: Desk):
    commanding = desk.in_control()
    commanding.command(Action.ARM, desk.report(), 101.0)
    desk.settle()
    commanding.tick(None, 130.0)
    assert Action.ARM in commanding.pending
    commanding.tick(None, 132.0)
    assert not commanding.pending
    assert not desk.notices[-1].good and desk.notices[-1].what is Action.ARM


def test_each_command_has_an_id_of_its_own(desk: Desk):
    commanding = desk.in_control()
    for _ in range(5):
        commanding.command(Action.PREVIEW, desk.report(), 101.0)
    assert len({command.command_id for command in desk.robot.wait_for(Command, 5)}) == 5
