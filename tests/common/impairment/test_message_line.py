"""The line of messages in virtual time."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from farhand.common.impairment.impairment import DirectionSettings
from farhand.common.impairment.message_line import MessageLine

N = 10_000
properties = settings(deadline=None, derandomize=True, max_examples=150)
directions = st.builds(
    lambda delay_ms, share, **rest: DirectionSettings(delay_ms=delay_ms, jitter_ms=delay_ms * share, **rest),
    delay_ms=st.floats(0, 5000),
    share=st.floats(0, 1),
    loss=st.sampled_from([0.0, 30.0, 100.0]),
    duplicate=st.sampled_from([0.0, 30.0, 100.0]),
    corrupt=st.sampled_from([0.0, 30.0]),
    reorder=st.sampled_from([0.0, 30.0]),
    reorder_ms=st.sampled_from([0.0, 50.0]),
    gap=st.integers(1, 4),
    rate_bps=st.sampled_from([0.0, 9600.0, 1e6]),
    queue_bytes=st.integers(0, 5000),
    seed=st.integers(0, 9),
)
steps = st.lists(st.tuples(st.floats(0, 0.5), st.integers(0, 5000)), min_size=1, max_size=30)


def send(line: MessageLine, messages: list[tuple[float, int]]) -> list[tuple[float, list[float]]]:
    """Each message's time of sending, after its pause, and of its arrivals."""
    now_s, sent = 100.0, []
    for pause_s, n_bytes in messages:
        now_s += pause_s
        sent.append((now_s, [arrival.due_s for arrival in line.push(now_s, n_bytes)]))
    return sent


def test_a_message_takes_its_time_to_send_and_the_delay():
    line = MessageLine(DirectionSettings(delay_ms=1000, rate_bps=8000))
    arrivals = [arrival for _ in range(2) for arrival in line.push(0.0, 500)]
    assert [arrival.due_s for arrival in arrivals] == pytest.approx([1.5, 2.0])


def test_duplicates_come_at_their_rate_each_with_a_delay_of_its_own():
    line = MessageLine(DirectionSettings(delay_ms=300, jitter_ms=20, duplicate=10))
    arrivals = [line.push(float(t), 1) for t in range(N)]
    duplicated = [pair for pair in arrivals if len(pair) == 2]
    assert len(duplicated) / N == pytest.approx(0.1, abs=4 * math.sqrt(0.1 * 0.9 / N))
    assert all(first != second for first, second in duplicated)


def test_reordered_messages_skip_the_delay_at_their_rate_and_not_before_their_gap():
    line = MessageLine(DirectionSettings(delay_ms=300, reorder=25, gap=3))
    skipped = [line.push(float(t), 1)[0].due_s == t for t in range(N)]
    indices = [t for t, is_skipped in enumerate(skipped) if is_skipped]
    apart = [later - earlier for earlier, later in pairwise(indices)]
    assert min(apart) == 3
    # Two that cannot skip, then a geometric number of tries: 2 + 1 / 0.25 = 6 apart on average.
    mean = sum(apart) / len(apart)
    assert mean == pytest.approx(6, abs=4 * math.sqrt(0.75 / 0.25**2 / len(apart)))


@pytest.mark.parametrize("is_path", [False, True])
def test_a_reordered_message_gains_as_much_as_it_is_told_and_never_arrives_before_it_was_sent(is_path):
    line = MessageLine(DirectionSettings(delay_ms=300, reorder=25, reorder_ms=100), is_path=is_path)
    delays_s = [line.push(t / 100, 1)[0].due_s - t / 100 for t in range(N)]
    early = [delay_s for delay_s in delays_s if delay_s < 0.25]
    assert early == pytest.approx([0.2] * len(early)) and len(early) / N == pytest.approx(0.25, abs=0.05)
    line = MessageLine(DirectionSettings(delay_ms=300, reorder=100, reorder_ms=500), is_path=is_path)
    assert line.push(1.0, 1)[0].due_s == 1.0


def test_messages_are_corrupted_at_their_rate_each_in_one_bit_anywhere():
    line = MessageLine(DirectionSettings(corrupt=20, duplicate=50))
    message = bytes(16)
    arrived = [arrival.received(message) for t in range(N) for arrival in line.push(float(t), len(message))]
    inverted = [int.from_bytes(data, "little") for data in arrived if data != message]
    assert all(bits.bit_count() == 1 for bits in inverted)
    assert len(inverted) / len(arrived) == pytest.approx(0.2, abs=4 * math.sqrt(0.2 * 0.8 / len(arrived)))
    # Each of the 128 bits as often as any other: chi squared has 127 degrees of freedom.
    expected = len(inverted) / 128
    counts = [sum(bits == 1 << bit for bits in inverted) for bit in range(128)]
    assert sum((n - expected) ** 2 / expected for n in counts) < 127 + 4 * math.sqrt(2 * 127)


def test_a_message_without_content_cannot_be_corrupted():
    (arrival,) = MessageLine(DirectionSettings(corrupt=100)).push(0.0, 0)
    assert arrival.corrupted_at is not None
    assert arrival.received(b"") == b""


def test_a_change_of_one_impairment_leaves_the_chance_of_the_others_alone():
    lossy = MessageLine(DirectionSettings(loss=30))
    lossy_and_late = MessageLine(DirectionSettings(loss=30, delay_ms=300, jitter_ms=20))
    lost = [[not line.push(float(t), 1) for t in range(200)] for line in (lossy, lossy_and_late)]
    assert lost[0] == lost[1]


@properties
@given(directions, steps)
def test_nothing_arrives_before_it_was_sent_and_everything_at_most_twice(direction, messages):
    for (sent_s, arrivals), (_, n_bytes) in zip(
        send(MessageLine(direction), messages), messages, strict=True
    ):
        sending_s = 8 * n_bytes / direction.rate_bps if direction.rate_bps else 0.0
        assert len(arrivals) <= 2
        assert all(arrival_s >= sent_s + sending_s - 1e-9 for arrival_s in arrivals)


@properties
@given(directions, steps)
def test_the_same_seed_gives_the_same_arrivals(direction, messages):
    assert send(MessageLine(direction, "up"), messages) == send(MessageLine(direction, "up"), messages)


@properties
@given(directions, steps)
def test_the_room_comes_back_when_all_has_arrived(direction, messages):
    line = MessageLine(direction)
    sent = send(line, messages)
    assert line.free_bytes(sent[-1][0]) <= direction.queue_limit_bytes
    latest_s = max((arrival_s for _, arrivals in sent for arrival_s in arrivals), default=200.0)
    assert line.free_bytes(max(latest_s, 200.0)) == direction.queue_limit_bytes
    line.push(latest_s + 200.0, 10**6)
    line.clear()
    assert line.free_bytes(latest_s + 200.0) == direction.queue_limit_bytes


@properties
@given(directions, directions, steps, steps)
def test_a_change_keeps_what_is_under_way(first, second, before, after):
    line, unchanged = MessageLine(first), MessageLine(first)
    assert send(line, before) == send(unchanged, before)
    line.change(second)
    assert line.settings == second
    send(line, after)


def test_on_a_path_jitter_keeps_the_order_and_its_bounds_and_only_reorder_overtakes():
    line = MessageLine(DirectionSettings(delay_ms=300, jitter_ms=20), is_path=True)
    due_s = [line.push(t / 1000, 100)[0].due_s for t in range(1000)]
    delays_s = [due - t / 1000 for t, due in enumerate(due_s)]
    assert due_s == sorted(due_s)
    assert min(delays_s) >= 0.28 and max(delays_s) <= 0.32 and max(delays_s) - min(delays_s) > 0.01
    line = MessageLine(DirectionSettings(delay_ms=300, jitter_ms=20, reorder=25), is_path=True)
    due_s = [line.push(t / 1000, 100)[0].due_s for t in range(1000)]
    assert 150 < sum(later < earlier for earlier, later in pairwise(due_s)) < 350


def test_after_a_change_to_a_shorter_delay_that_is_in_force_at_once():
    line = MessageLine(DirectionSettings(delay_ms=5000), is_path=True)
    line.push(0.0, 100)
    line.change(DirectionSettings(delay_ms=300))
    assert line.push(1.0, 100)[0].due_s == pytest.approx(1.3)
