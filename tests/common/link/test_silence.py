from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from farhand.common.link.budget import Silence, SilenceGate

FIRST_WINDOW_BYTES = 12_000
OVERHEAD_BYTES = 100  # of the transport, generously


class Clock:
    def __init__(self) -> None:
        self.now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


def sent(gate: SilenceGate, clock: Clock, n_bytes: int, hz: float, duration_s: float) -> int:
    """How many messages of a flow go out in a time in which nothing is heard."""
    n = 0
    for _ in range(round(duration_s * hz)):
        clock.now_s += 1 / hz
        n += gate.lets_out(n_bytes)
    return n


def test_all_go_out_while_the_other_site_is_heard():
    clock = Clock()
    silence = Silence(clock=clock)
    gate = SilenceGate(silence)
    for _ in range(1000):
        clock.now_s += 0.04
        silence.heard()
        assert gate.lets_out(300)


def test_what_goes_out_in_half_a_minute_of_silence_fits_the_first_congestion_window():
    clock = Clock()
    reports = sent(SilenceGate(Silence(clock=clock)), clock, 264, 25.0, 30.0)
    heartbeats = sent(SilenceGate(Silence(clock=clock)), clock, 40, 10.0, 30.0)
    assert reports * (264 + OVERHEAD_BYTES) < FIRST_WINDOW_BYTES
    assert heartbeats * (40 + OVERHEAD_BYTES) < FIRST_WINDOW_BYTES
    assert heartbeats >= 3 * 25  # so the end of an outage is noticed within a third of a second


def test_the_first_thing_heard_opens_the_gate_at_once():
    clock = Clock()
    silence = Silence(clock=clock)
    gate = SilenceGate(silence)
    sent(gate, clock, 264, 25.0, 20.0)
    assert not gate.lets_out(264)
    silence.heard()
    assert gate.lets_out(264)


@pytest.mark.parametrize(("rate_bps", "passes"), [(0.0, False), (9600.0, True), (10e6, False)])
def test_on_a_narrow_link_a_second_without_a_message_is_no_silence(rate_bps: float, passes: bool):
    clock = Clock()
    gate = SilenceGate(Silence(rate_bps, clock))
    clock.now_s += 1.0
    assert gate.lets_out(264)  # the first probe
    assert gate.lets_out(264) is passes


@settings(deadline=None, derandomize=True, max_examples=100)
@given(st.lists(st.tuples(st.floats(0.001, 2.0), st.integers(0, 1200), st.booleans()), max_size=200))
def test_a_message_is_held_back_only_while_nothing_is_heard_and_another_went_out_just_before(steps):
    clock = Clock()
    silence = Silence(clock=clock)
    gate = SilenceGate(silence)
    heard_s, passed_s = clock.now_s, {True: 0.0, False: 0.0}
    for pause_s, n_bytes, heard in steps:
        clock.now_s += pause_s
        if heard:
            silence.heard()
            heard_s = clock.now_s
        small = n_bytes < 128
        if gate.lets_out(n_bytes):
            passed_s[small] = clock.now_s
        else:
            assert clock.now_s - heard_s > 0.5
            assert clock.now_s - passed_s[small] < (0.34 if small else 5.0)


def test_what_a_site_sends_in_half_a_minute_of_silence_beside_its_streams_fits_the_window_too():
    clock = Clock()
    silence = Silence(clock=clock)
    gate = SilenceGate(silence)
    stops = questions = 0
    for _ in range(300):  # a stop that nobody acknowledges, and the lease asked for each second
        clock.now_s += 0.1
        if silence.is_unusual:
            stops += gate.lets_stop()
            questions += gate.lets_ask()
    assert stops * (70 + OVERHEAD_BYTES) + questions * (160 + OVERHEAD_BYTES) < FIRST_WINDOW_BYTES
    assert stops >= 40  # so the end of an outage is noticed soon
