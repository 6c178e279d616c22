from __future__ import annotations

import threading

from farhand.common.clock import BootClock, Rate


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
