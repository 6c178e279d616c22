"""The line of a stream in virtual time."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from farhand.common.impairment.delay_line import DelayLine
from farhand.common.impairment.impairment import DirectionSettings

properties = settings(deadline=None, derandomize=True, max_examples=150)

directions = st.builds(
    lambda delay_ms, share, distribution, rate_bps, queue_bytes, seed: DirectionSettings(
        delay_ms=delay_ms,
        jitter_ms=0.0 if distribution == "none" else delay_ms * share,
        distribution=distribution,
        rate_bps=rate_bps,
        queue_bytes=queue_bytes,
        seed=seed,
    ),
    delay_ms=st.floats(0, 5000),
    share=st.floats(0, 1),
    distribution=st.sampled_from(["none", "uniform", "normal"]),
    rate_bps=st.sampled_from([0.0, 9600.0, 1e6]),
    queue_bytes=st.integers(0, 100_000),
    seed=st.integers(0, 9),
)
steps = st.lists(st.tuples(st.floats(0, 0.5), st.integers(0, 5000)), min_size=1, max_size=30)


def send(line: DelayLine, pieces: list[tuple[float, int]]) -> list[float]:
    """Push pieces after their pauses; when they arrive."""
    now_s, arrivals = 100.0, []
    for pause_s, n_bytes in pieces:
        now_s += pause_s
        arrivals.append(line.push(now_s, n_bytes))
    return arrivals


def drain(line: DelayLine) -> tuple[list[float], list[int]]:
    """When the pieces under way arrive, and their sizes."""
    due_s, sizes = [], []
    while line.next_due_s is not None:
        due_s.append(line.next_due_s)
        sizes.append(line.pop())
    return due_s, sizes


def test_a_piece_arrives_exactly_one_delay_after_it_was_sent():
    line = DelayLine(DirectionSettings(delay_ms=300))
    assert line.push(5.0, 10) == pytest.approx(5.3)
    assert line.push(5.1, 10) == pytest.approx(5.4)


def test_the_rate_makes_pieces_wait_for_each_other():
    line = DelayLine(DirectionSettings(delay_ms=1000, rate_bps=8000))
    assert [line.push(0.0, 500) for _ in range(3)] == pytest.approx([1.5, 2.0, 2.5])
    assert line.push(10.0, 500) == pytest.approx(11.5)  # an idle line saves nothing up


@properties
@given(directions, steps)
def test_nothing_overtakes_and_nothing_arrives_before_it_was_sent(direction, pieces):
    arrivals = send(DelayLine(direction), pieces)
    assert arrivals == sorted(arrivals)
    now_s = 100.0
    for (pause_s, _), arrival_s in zip(pieces, arrivals, strict=True):
        now_s += pause_s
        assert arrival_s >= now_s


@properties
@given(st.floats(0, 3000), st.sampled_from([9600.0, 1e6]), steps)
def test_no_span_of_time_carries_more_than_the_rate(delay_ms, rate_bps, pieces):
    arrivals = send(DelayLine(DirectionSettings(delay_ms=delay_ms, rate_bps=rate_bps)), pieces)
    for (earlier_s, later_s), (_, n_bytes) in zip(pairwise(arrivals), pieces[1:], strict=True):
        assert later_s - earlier_s >= 8 * n_bytes / rate_bps - 1e-9


@properties
@given(directions, steps)
def test_uncrowded_pieces_arrive_within_the_jitter(direction, pieces):
    spaced = [(60.0, n_bytes) for _, n_bytes in pieces]  # longer than any delay: nobody waits
    reach_ms = {"none": 0.0, "uniform": direction.jitter_ms, "normal": 3 * direction.jitter_ms}
    for i, arrival_s in enumerate(send(DelayLine(direction), spaced)):
        sending_s = 8 * spaced[i][1] / direction.rate_bps if direction.rate_bps else 0.0
        delay_ms = 1000 * (arrival_s - 100.0 - 60.0 * (i + 1) - sending_s)
        assert abs(delay_ms - direction.delay_ms) <= reach_ms[direction.distribution] + 1e-6


@properties
@given(directions, steps)
def test_the_same_seed_gives_the_same_arrivals(direction, pieces):
    assert send(DelayLine(direction, "up/1"), pieces) == send(DelayLine(direction, "up/1"), pieces)


def test_another_seed_or_stream_gives_other_arrivals():
    jittery = DirectionSettings(delay_ms=300, jitter_ms=20)
    pieces = [(1.0, 1)] * 5
    reseeded = DirectionSettings(delay_ms=300, jitter_ms=20, seed=1)
    sequences = [
        send(DelayLine(jittery, "up/1"), pieces),
        send(DelayLine(jittery, "up/2"), pieces),
        send(DelayLine(reseeded, "up/1"), pieces),
    ]
    assert sequences[0] != sequences[1] != sequences[2] != sequences[0]


@properties
@given(directions, steps, st.integers(0, 60))
def test_a_sender_who_respects_free_bytes_never_exceeds_the_queue(direction, pieces, n_popped):
    line = DelayLine(direction)
    sent = []
    for pause_s, wanted in pieces:
        sent.append(min(wanted, line.free_bytes))
        line.push(pause_s, sent[-1])
        assert line.queued_bytes == sum(sent) <= direction.queue_limit_bytes
    taken = [line.pop() for _ in range(min(n_popped, len(sent)))]
    assert taken == sent[: len(taken)]
    assert line.queued_bytes == sum(sent[len(taken) :])
    line.clear()
    assert line.queued_bytes == 0
    assert line.next_due_s is None


@properties
@given(directions, directions, steps, steps)
def test_a_change_while_running_keeps_the_order_and_what_is_under_way(first, second, before, after):
    line, unchanged = DelayLine(first), DelayLine(first)
    arrivals = send(line, before)
    assert arrivals == send(unchanged, before)
    line.change(second)
    assert line.next_due_s == arrivals[0]
    arrivals += send(line, after)
    assert arrivals == sorted(arrivals)
    assert [line.pop() for _ in arrivals] == [n_bytes for _, n_bytes in before + after]


def test_a_changed_delay_holds_for_what_is_sent_later():
    line = DelayLine(DirectionSettings(delay_ms=100))
    assert line.push(0.0, 1) == pytest.approx(0.1)
    line.change(DirectionSettings(delay_ms=600))
    assert line.push(0.05, 1) == pytest.approx(0.65)
    line.change(DirectionSettings())
    assert line.push(0.06, 1) == pytest.approx(0.65)  # behind the one before
    assert line.push(0.7, 1) == pytest.approx(0.7)


def test_time_stands_still_on_a_stalled_line():
    line = DelayLine(DirectionSettings(delay_ms=300, rate_bps=8000))
    line.push(0.0, 100)
    assert line.next_due_s == pytest.approx(0.4)
    line.stall(0.2, 10.2)
    assert line.next_due_s == pytest.approx(10.4)
    assert line.push(5.0, 100) == pytest.approx(10.6)  # sent at 10.2, takes 0.1, arrives 0.3 later
    assert line.push(5.0, 100) == pytest.approx(10.7)  # and the rate holds for the backlog


def test_ending_a_stall_early_gives_the_rest_of_it_back():
    line = DelayLine(DirectionSettings(delay_ms=300))
    line.push(0.0, 1)
    line.stall(0.1, 60.1)
    line.stall(2.1, 2.1)
    assert line.next_due_s == pytest.approx(2.3)
    line.stall(2.2, -math.inf)  # ending a stall that is over changes nothing
    assert line.next_due_s == pytest.approx(2.3)
    assert line.push(2.2, 1) == pytest.approx(2.5)


@properties
@given(directions, steps, st.lists(st.tuples(st.floats(0, 1), st.floats(0, 5)), min_size=1, max_size=10))
def test_stalls_keep_the_order_and_never_hasten_anything(direction, pieces, stalls):
    plain, stalled = DelayLine(direction), DelayLine(direction)
    now_s = 0.0
    for i, (pause_s, n_bytes) in enumerate(pieces):
        now_s += pause_s
        plain.push(now_s, n_bytes)
        stalled.push(now_s, n_bytes)
        if i < len(stalls):
            now_s += stalls[i][0]
            stalled.stall(now_s, now_s + stalls[i][1])  # may also end the one before early
    (due_s, sizes), (late_s, late_sizes) = drain(plain), drain(stalled)
    assert late_sizes == sizes
    assert late_s == sorted(late_s)
    assert all(late >= due - 1e-9 for due, late in zip(due_s, late_s, strict=True))
