from __future__ import annotations

import threading
import time

import pytest

from farhand.common.clock import BootClock, Rate, SuspendWatch


def test_a_clock_reads_its_source():
    clock = BootClock("boot", lambda: 1_500_000_000)
    assert (clock.boot, clock.now_ns(), clock.now_s()) == ("boot", 1_500_000_000, 1.5)


def test_each_boot_has_a_name_of_its_own():
    assert BootClock().boot != BootClock().boot


def test_a_clock_never_runs_backwards():
    clock = BootClock()
    readings = [clock.now_ns() for _ in range(1000)]
    assert readings == sorted(readings)


def test_a_loop_that_is_asked_to_end_does_not_wait_for_its_tick():
    stop = threading.Event()
    stop.set()
    assert not Rate(3600.0, stop).wait()


def test_a_loop_that_is_too_slow_counts_what_it_missed_and_goes_on():
    rate = Rate(1e-9, threading.Event())
    assert all(rate.wait() for _ in range(10))
    assert 1 <= rate.overruns <= 10


class TwoClocks:
    """A computer's two clocks: both run on, but only one while it is suspended."""

    def __init__(self) -> None:
        self.awake_ns, self.elapsed_ns, self.held_up_ns = 5_000, 9_000, 0

    def watch(self) -> SuspendWatch:
        return SuspendWatch(self._read_awake, lambda: self.elapsed_ns)

    def _read_awake(self) -> int:
        self.run(self.held_up_ns * 1e-9)  # the process is held up before each reading
        return self.awake_ns

    def run(self, duration_s: float) -> None:
        self.awake_ns += round(duration_s * 1e9)
        self.elapsed_ns += round(duration_s * 1e9)

    def suspend(self, duration_s: float) -> None:
        self.elapsed_ns += round(duration_s * 1e9)


def test_a_suspend_is_noticed_once_with_its_length():
    clocks = TwoClocks()
    watch = clocks.watch()
    for _ in range(3):
        clocks.run(100.0)
        assert watch.suspended_s() == 0.0
    clocks.suspend(60.0)
    assert watch.suspended_s() == pytest.approx(60.0)
    clocks.run(0.02)
    assert watch.suspended_s() == 0.0


def test_a_process_that_is_held_up_was_not_suspended():
    clocks = TwoClocks()
    watch = clocks.watch()
    clocks.held_up_ns = 3_000_000_000  # also between the readings of the two clocks
    for _ in range(5):
        assert watch.suspended_s() == 0.0
    clocks.held_up_ns = 0
    assert watch.suspended_s() == 0.0


def test_short_suspends_add_up_until_they_are_noticed():
    clocks = TwoClocks()
    watch, noticed = clocks.watch(), 0.0
    for _ in range(10):
        clocks.suspend(0.04)
        clocks.run(1.0)
        noticed += watch.suspended_s()
    assert noticed == pytest.approx(0.36)


def test_the_clock_of_ages_counts_a_suspend():
    if not hasattr(time, "CLOCK_BOOTTIME"):
        pytest.skip("this system has no such clock")
    before_ns = time.clock_gettime_ns(time.CLOCK_BOOTTIME)
    reading_ns = BootClock().now_ns()
    assert before_ns <= reading_ns <= time.clock_gettime_ns(time.CLOCK_BOOTTIME)
