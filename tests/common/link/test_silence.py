from __future__ import annotations

from collections import Counter
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from farhand.common.link.budget import OVERHEAD_BYTES, Silence, SilenceGate
from farhand.common.wire import keys
from farhand.common.wire.keys import Channel

FIRST_WINDOW_BYTES = 12_000
QUIC_BYTES, MARK_BYTES = (
    78,
    19,
)  # of the transport, as measured; and of a stream's mark, which is left out in a silence
NOTICED_S, ROUND_TRIP_S = 0.5, 0.6
POINT_BYTES, ARM_BYTES, HEARTBEAT_BYTES = 97, 190, 72

CHANNELS = (keys.TELEMETRY, keys.HEARTBEAT, keys.INPUT, keys.PATH)


class Clock:
    def __init__(self) -> None:
        self.now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


def sent(
    gate: SilenceGate, clock: Clock, channel: Channel, n_bytes: int, hz: float, duration_s: float
) -> list[float]:
    """Times at which messages of a flow go out while nothing is heard [s]."""
    times_s = []
    for _ in range(round(duration_s * hz)):
        clock.now_s += 1 / hz
        if gate.lets_out(channel, n_bytes + OVERHEAD_BYTES):
            times_s.append(clock.now_s)
    return times_s


def test_all_go_out_while_the_other_site_is_heard():
    clock = Clock()
    silence = Silence(clock=clock)
    gate = SilenceGate(silence)
    for _ in range(1000):
        clock.now_s += 0.04
        silence.heard()
        assert gate.lets_out(keys.TELEMETRY, 300)


@pytest.mark.parametrize(
    ("channel", "n_bytes", "hz"),
    [(keys.TELEMETRY, POINT_BYTES, 25.0), (keys.TELEMETRY, ARM_BYTES, 25.0), (keys.HEARTBEAT, HEARTBEAT_BYTES, 10.0)],
)  # fmt: skip
def test_what_goes_out_in_half_a_minute_of_silence_fits_the_first_congestion_window(
    channel: Channel, n_bytes: int, hz: float
):
    clock = Clock()
    gate = SilenceGate(Silence(clock=clock))
    full = len(sent(gate, clock, channel, n_bytes, hz, NOTICED_S)) + round(ROUND_TRIP_S * hz)
    few = Counter[Channel]()
    for _ in range(round(28.0 * hz)):
        clock.now_s += 1 / hz
        if gate.lets_out(channel, n_bytes + OVERHEAD_BYTES):
            few[gate.reports if channel is keys.TELEMETRY else channel] += 1
    used_bytes = {each: n * (n_bytes + QUIC_BYTES - MARK_BYTES) for each, n in few.items()}
    used_bytes[channel] += full * (n_bytes + QUIC_BYTES)
    assert max(used_bytes.values()) < FIRST_WINDOW_BYTES
    others = [n for each, n in used_bytes.items() if each is not channel]  # stops and events need room there
    assert not others or max(others) <= FIRST_WINDOW_BYTES - 2000


@pytest.mark.parametrize(("n_bytes", "for_s"), [(POINT_BYTES, 28.0), (ARM_BYTES, 22.0)])
def test_reports_leave_four_times_a_second_while_a_window_has_room(n_bytes: int, for_s: float):
    clock = Clock()
    gate = SilenceGate(Silence(clock=clock))
    sent(gate, clock, keys.TELEMETRY, n_bytes, 25.0, NOTICED_S)
    times_s = sent(gate, clock, keys.TELEMETRY, n_bytes, 25.0, for_s)
    pauses_s = [later - earlier for earlier, later in pairwise(times_s)]
    assert max(pauses_s) <= 0.25 + 1e-9


def test_heartbeats_leave_every_0_4_s_all_the_time_so_that_the_end_of_an_outage_is_noticed():
    clock = Clock()
    gate = SilenceGate(Silence(clock=clock))
    sent(gate, clock, keys.HEARTBEAT, HEARTBEAT_BYTES, 10.0, NOTICED_S)
    times_s = sent(gate, clock, keys.HEARTBEAT, HEARTBEAT_BYTES, 10.0, 60.0)
    assert max(later - earlier for earlier, later in pairwise(times_s)) <= 0.51


def test_the_first_thing_heard_opens_the_gate_at_once():
    clock = Clock()
    silence = Silence(clock=clock)
    gate = SilenceGate(silence)
    sent(gate, clock, keys.TELEMETRY, 264, 25.0, 20.0)
    gate.lets_out(keys.TELEMETRY, 264)  # it may be due
    assert not gate.lets_out(keys.TELEMETRY, 264)
    silence.heard()
    assert gate.lets_out(keys.TELEMETRY, 264)


@pytest.mark.parametrize(("rate_bps", "passes"), [(0.0, False), (9600.0, True), (10e6, False)])
def test_on_a_narrow_link_a_second_without_a_message_is_no_silence(rate_bps: float, passes: bool):
    clock = Clock()
    gate = SilenceGate(Silence(rate_bps, clock))
    clock.now_s += 1.0
    assert gate.lets_out(keys.TELEMETRY, 264)  # the first probe
    assert gate.lets_out(keys.TELEMETRY, 264) is passes


@settings(deadline=None, derandomize=True, max_examples=100)
@given(
    st.lists(
        st.tuples(st.floats(0.001, 2.0), st.sampled_from(CHANNELS), st.integers(0, 1200), st.booleans()),
        max_size=200,
    )
)
def test_a_message_is_held_back_only_while_nothing_is_heard_and_another_went_out_just_before(steps):
    clock = Clock()
    silence = Silence(clock=clock)
    gate = SilenceGate(silence)
    heard_s, passed_s = clock.now_s, dict.fromkeys(CHANNELS, 0.0)
    for pause_s, channel, n_bytes, heard in steps:
        clock.now_s += pause_s
        if heard:
            silence.heard()
            heard_s = clock.now_s
        if gate.lets_out(channel, n_bytes):
            passed_s[channel] = clock.now_s
        else:
            assert clock.now_s - heard_s > 0.5
            assert clock.now_s - passed_s[channel] < (0.4 if channel is keys.HEARTBEAT else 5.0)


def test_what_a_site_sends_in_half_a_minute_of_silence_beside_its_streams_fits_the_window_too():
    clock = Clock()
    silence = Silence(clock=clock)
    gate = SilenceGate(silence)
    stops = questions = 0
    for _ in range(300):  # a stop that nobody acknowledges, and the lease asked for each second
        clock.now_s += 0.1
        if silence.is_unusual:
            stops += gate.lets_out(keys.STOP, 70)
            questions += gate.lets_out(keys.LEASE, 160)
    assert stops * (70 + QUIC_BYTES) + questions * (160 + QUIC_BYTES) < FIRST_WINDOW_BYTES
    assert stops >= 40  # so the end of an outage is noticed soon
