from __future__ import annotations

import zenoh

from farhand.common.wire import keys
from farhand.common.wire.keys import Urgency


def test_every_channel_has_a_key_of_its_own_and_is_in_the_table():
    channels = [value for value in vars(keys).values() if isinstance(value, keys.Channel)]
    assert sorted(c.key for c in channels) == sorted(
        c.key for c in (*keys.ALL, keys.RIGHT, *keys.REPORTS[1:])
    )
    assert len({c.key for c in channels}) == len(channels)


def test_stops_and_their_acknowledgements_come_before_everything_else():
    priority = {channel: getattr(zenoh.Priority, channel.urgency.value) for channel in keys.ALL}
    first = [channel for channel in keys.ALL if priority[channel] == zenoh.Priority.REAL_TIME]
    assert first == [channel for channel in keys.ALL if channel in {keys.STOP, keys.STOP_ACK}]
    assert len(first) == 2


def test_pictures_come_after_everything_else():
    priority = {channel: getattr(zenoh.Priority, channel.urgency.value) for channel in keys.ALL}
    last = [channel for channel in keys.ALL if priority[channel] == zenoh.Priority.BACKGROUND]
    assert last == [keys.PICTURE] and list(Urgency)[-1] is keys.PICTURE.urgency


def test_what_must_not_be_lost_is_never_dropped_and_what_ages_always_may_be():
    ages = {keys.INPUT, keys.HEARTBEAT, keys.TELEMETRY, keys.PATH, keys.PICTURE}
    assert {channel for channel in keys.ALL if not channel.must_arrive} == ages
