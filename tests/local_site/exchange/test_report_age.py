from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from farhand.common.mode_table import ControlMode
from farhand.common.wire.messages import Stamp, Telemetry
from farhand.local_site.exchange.report_age import LinkHealth, LinkMonitor


def report(seq: int, boot: str = "one", echo: int = 0, held_ms: float = 0.0) -> Telemetry:
    return Telemetry(
        seq=seq, stamp=Stamp(boot, seq), mode=ControlMode.HOLD, position_m=(0.0, 0.0), frame_origin_m=(0.0, 0.0),
        heartbeat_echo=echo, heartbeat_held_ms=held_ms,
    )  # fmt: skip


def test_before_the_first_report_nothing_is_known():
    view = LinkMonitor().view(5.0)
    assert (view.health, view.round_trip_s, view.age_s, view.n_received) == (LinkHealth.NEVER, None, None, 0)


@pytest.mark.parametrize(
    ("silent_s", "health"),
    [
        (0.0, LinkHealth.OK),
        (0.4, LinkHealth.OK),
        (0.5, LinkHealth.LATE),
        (1.9, LinkHealth.LATE),
        (2.0, LinkHealth.LOST),
    ],
)
def test_silence_makes_the_link_late_and_then_lost(silent_s, health):
    monitor = LinkMonitor()
    monitor.received(report(1), 10.0)
    view = monitor.view(10.0 + silent_s)
    assert view.health is health and view.silent_s == pytest.approx(silent_s)


def test_the_round_trip_leaves_out_what_the_robot_held_back():
    monitor = LinkMonitor()
    monitor.heartbeat_sent(7, 1.0)
    monitor.received(report(1, echo=7, held_ms=30.0), 1.65)
    assert monitor.view(1.65).round_trip_s == pytest.approx(0.62)
    assert monitor.view(1.75).age_s == pytest.approx(0.1 + 0.31)
    assert monitor.median_round_trip_s() == pytest.approx(0.62)


def test_a_heartbeat_is_measured_by_its_first_echo_alone():
    monitor = LinkMonitor()
    monitor.heartbeat_sent(7, 1.0)
    monitor.received(report(1, echo=7), 1.5)
    monitor.received(report(2, echo=7), 9.0)
    assert monitor.view(9.0).round_trip_s == pytest.approx(0.5)


def test_an_echo_of_what_was_never_sent_measures_nothing():
    monitor = LinkMonitor()
    monitor.received(report(1, echo=99), 1.5)
    assert monitor.view(1.5).round_trip_s is None and monitor.median_round_trip_s() is None


@settings(deadline=None, derandomize=True, max_examples=100)
@given(seqs=st.lists(st.integers(1, 50), min_size=1, max_size=40))
def test_only_newer_reports_are_shown_and_the_gaps_counted(seqs):
    monitor, newest, received, missed = LinkMonitor(), None, 0, 0
    for seq in seqs:
        is_newer = newest is None or seq > newest
        assert monitor.received(report(seq), 1.0) == is_newer
        if is_newer:
            received += 1
            missed += 0 if newest is None else seq - newest - 1
            newest = seq
    view = monitor.view(1.0)
    assert (view.n_received, view.n_missed) == (received, missed)


def test_a_new_boot_of_the_robot_begins_to_count_anew():
    monitor = LinkMonitor()
    monitor.received(report(500), 1.0)
    assert monitor.received(report(1, boot="two"), 2.0)
    assert monitor.view(2.0).n_missed == 0


def test_what_an_outage_held_up_is_late_by_the_time_it_waited():
    monitor = LinkMonitor()
    clocks_apart_s, way_s = 1000.0, 0.3

    def arrives_s(sent_s: float, held_up_s: float = 0.0) -> float:
        return sent_s + clocks_apart_s + way_s + held_up_s

    def stamp(sent_s: float) -> Stamp:
        return Stamp("one", round(sent_s * 1e9))

    assert monitor.late_s(stamp(1.0), arrives_s(1.0)) == 0.0
    for n in range(100):
        monitor.received(replace(report(n + 1), stamp=stamp(0.04 * n)), arrives_s(0.04 * n))
    # The first that comes through is a backlog: reports that are themselves old.
    for n in range(100, 120):
        monitor.received(
            replace(report(n + 1), stamp=stamp(0.04 * n)), arrives_s(0.04 * n, 25.0 - 0.04 * (n - 100))
        )
    assert monitor.late_s(stamp(4.5), arrives_s(4.5, 24.0)) == pytest.approx(24.0)
    assert monitor.late_s(stamp(30.0), arrives_s(30.0)) == pytest.approx(0.0, abs=1e-9)
    assert monitor.late_s(Stamp("next boot", 0), 5.0) == 0.0


def aged(seq: int, age_s: float, now_s: float) -> Telemetry:
    return Telemetry(
        seq=seq, stamp=Stamp("boot", round((now_s - age_s) * 1e9)), mode=ControlMode.HOLD, position_m=(0.0, 0.0),
        frame_origin_m=(0.0, 0.0),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("age_s", "health"),
    [
        (0.3, LinkHealth.OK),
        (1.2, LinkHealth.OK),
        (1.4, LinkHealth.LATE),
        (5.2, LinkHealth.LATE),
        (18.8, LinkHealth.LOST),
    ],
)
def test_reports_that_keep_coming_but_grow_old_are_not_ok(age_s: float, health: LinkHealth) -> None:
    """A.1: 18.8 s old, and the page said LINK OK."""
    monitor = LinkMonitor()
    for seq in range(1, 200):
        now_s = 100.0 + 0.04 * seq
        monitor.received(aged(seq, 0.3 + (age_s - 0.3) * seq / 199, now_s), now_s)
    monitor.received(aged(200, age_s, 108.0), 108.0)
    assert monitor.view(108.0).health is health
    assert not monitor.is_silent(108.0)  # nothing was missed


def test_reports_that_are_old_from_the_first_are_not_ok_either() -> None:
    for round_trip_s, health in ((2.0, LinkHealth.OK), (11.0, LinkHealth.LATE), (40.0, LinkHealth.LOST)):
        monitor = LinkMonitor()
        monitor.heartbeat_sent(7, 1.0)
        monitor.received(report(1, echo=7), 1.0 + round_trip_s)
        assert monitor.view(1.0 + round_trip_s).health is health


def made_at(time_s: float, seq: int, echo: int) -> Telemetry:
    return replace(report(seq, echo=echo), stamp=Stamp("one", round(1e9 * time_s)))


def test_a1_a_report_that_an_outage_held_up_is_as_old_as_it_is() -> None:
    monitor = LinkMonitor()
    for seq in range(1, 21):
        now_s = 100.0 + 0.1 * seq
        monitor.heartbeat_sent(seq, now_s - 0.6)
        monitor.received(made_at(now_s - 0.3, seq, echo=seq), now_s)
    usual = monitor.view(102.0).age_s
    monitor.received(made_at(101.8, 21, echo=20), 112.0)
    held_up = monitor.view(112.0)
    assert usual is not None and abs(usual - 0.3) < 0.05
    assert held_up.age_s is not None and abs(held_up.age_s - 10.2) < 0.05
    assert held_up.health is LinkHealth.LOST
