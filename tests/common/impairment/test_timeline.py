"""Settings that change with time."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from farhand.common.errors import InvalidConfiguration
from farhand.common.impairment.impairment import DirectionSettings, LinkSettings
from farhand.common.impairment.link_profile import LinkTimeline, TimelineStep

BASE = LinkSettings(uplink=DirectionSettings(delay_ms=100))

milliseconds = st.integers(0, 50_000).map(lambda ms: ms / 1000)


def steps(*times_s: float) -> tuple[TimelineStep, ...]:
    """The n-th step has a delay of n ms."""
    return tuple(
        TimelineStep(at_s=at_s, uplink={"delay_ms": float(n)}) for n, at_s in enumerate(times_s, start=1)
    )


def delay_ms(timeline: LinkTimeline, elapsed_s: float) -> float:
    return timeline.at(elapsed_s).uplink.delay_ms


def test_each_step_holds_until_the_next_and_the_last_for_ever():
    timeline = LinkTimeline(BASE, steps(1.0, 3.0))
    assert [delay_ms(timeline, t) for t in (0.0, 0.99, 1.0, 2.99, 3.0, 1e6)] == [100, 100, 1, 1, 2, 2]
    assert [timeline.next_change_s(t) for t in (0.0, 1.0, 3.0)] == [1.0, 3.0, None]


def test_what_a_step_does_not_name_is_the_bases():
    timeline = LinkTimeline(BASE, (TimelineStep(at_s=1.0, downlink={"delay_ms": 7}),))
    assert timeline.at(2.0) == LinkSettings(
        uplink=DirectionSettings(delay_ms=100), downlink=DirectionSettings(delay_ms=7)
    )


def test_a_timeline_that_repeats_begins_anew_with_the_base():
    timeline = LinkTimeline(BASE, steps(1.0, 3.0), repeat_s=4.0)
    assert [delay_ms(timeline, 40.0 + t) for t in (0.0, 1.0, 3.5, 4.0)] == [100, 1, 2, 100]
    assert [timeline.next_change_s(t) for t in (40.0, 41.0, 43.0)] == [41.0, 43.0, 44.0]


def test_settings_without_steps_never_change():
    assert LinkTimeline(BASE).next_change_s(0.0) is None
    assert LinkTimeline(BASE, repeat_s=5.0).next_change_s(0.0) is None


@settings(deadline=None, derandomize=True, max_examples=200)
@given(
    st.lists(milliseconds, min_size=1, max_size=5, unique=True),
    st.one_of(st.just(0.0), st.integers(10, 60_000).map(lambda ms: ms / 1000)),
    st.floats(0, 1e4),
)
def test_following_the_changes_misses_none_and_always_goes_on(times_s, longer_s, begin_s):
    times_s = sorted(times_s)
    repeat_s = times_s[-1] + longer_s if longer_s else 0.0
    timeline = LinkTimeline(BASE, steps(*times_s), repeat_s)
    now_s = begin_s
    for _ in range(20):
        following_s = timeline.next_change_s(now_s)
        if following_s is None:
            assert not repeat_s
            return
        assert following_s > now_s
        between_s = now_s + 0.5 * (following_s - now_s)
        assert timeline.at(between_s) == timeline.at(now_s)
        now_s = following_s


@pytest.mark.parametrize(
    ("wrong", "repeat_s", "field", "says"),
    [
        (steps(2.0, 1.0), 0.0, "timeline[1].at_s", "a time from 2 on, not 1"),
        (steps(-1.0), 0.0, "timeline[0].at_s", "a time from 0 on"),
        (steps(math.nan), 0.0, "timeline[0].at_s", "not nan"),
        (steps(1.0), 1.0, "repeat_s", "more than the last step's 1 s"),
        ((TimelineStep(at_s=0.0, uplink={"speed": 1}),), 0.0, "timeline[0].uplink", "unknown field `speed`"),
        ((TimelineStep(at_s=0.0, downlink={"loss": 200}),), 0.0, "timeline[0].downlink", "loss must be"),
    ],
)
def test_a_malformed_step_is_refused_by_name(wrong, repeat_s, field, says):
    with pytest.raises(InvalidConfiguration, match=says) as caught:
        LinkTimeline(BASE, wrong, repeat_s, "links.toml")
    assert (caught.value.source, caught.value.field) == ("links.toml", field)
