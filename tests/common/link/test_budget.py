from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from farhand.common.link.budget import budget_bytes_s, limit_flows, part_bytes, period_s
from farhand.common.wire import keys
from farhand.common.wire.keys import Channel

UPWARDS = (keys.INPUT, keys.HEARTBEAT)
DOWNWARDS = (keys.TELEMETRY, keys.PATH)


class Limits:
    def __init__(self) -> None:
        self.of: dict[Channel, float] = {}

    def limit(self, channel: Channel, bytes_per_s: float) -> None:
        self.of[channel] = bytes_per_s


@given(rate_bps=st.floats(1.0, 1e9))
@settings(deadline=None, derandomize=True, max_examples=50)
def test_the_streams_of_each_direction_leave_a_third_for_commands_and_stops(rate_bps: float):
    for direction in (UPWARDS, DOWNWARDS):
        assert sum(budget_bytes_s(channel, rate_bps) for channel in direction) <= 0.67 * rate_bps / 8


def test_what_pictures_take_beside_the_streams_leaves_room_for_commands_and_stops():
    assert sum(budget_bytes_s(channel, 8.0) for channel in (*DOWNWARDS, keys.PICTURE)) <= 0.85


def test_what_must_arrive_is_never_held_back():
    for channel in keys.ALL:
        if channel.must_arrive:
            assert budget_bytes_s(channel, 9600.0) == 0.0


def test_a_link_that_carries_enough_holds_nothing_back():
    limits = Limits()
    limit_flows(limits, 0.0)  # type: ignore[arg-type]
    assert limits.of and not any(limits.of.values())
    assert period_s(keys.TELEMETRY, 25.0, 200, 0.0) == pytest.approx(0.04)


def test_an_acoustic_modem_still_carries_two_reports_a_second():
    assert period_s(keys.TELEMETRY, 25.0, 200, 9600.0) <= 0.5


@given(rate_bps=st.floats(0.0, 1e9))
@settings(deadline=None, derandomize=True, max_examples=50)
def test_a_part_of_a_model_holds_a_stop_up_for_half_a_second_at_most_where_that_is_possible(rate_bps: float):
    n_bytes = part_bytes(rate_bps)
    assert 256 <= n_bytes <= 32_768
    if rate_bps >= 8 * 256 / 0.5:
        assert n_bytes * 8 / rate_bps <= 0.5
