"""The settings of an impaired link: what is refused, and what a TCP relay can obey."""

from __future__ import annotations

import math
from typing import Any

import pytest

from farhand.common.impairment.impairment import DirectionSettings, LinkSettings

NUMBERS = [
    "delay_ms", "jitter_ms", "correlation", "loss", "loss_correlation", "gemodel_p", "gemodel_r", "gemodel_1_h",
    "gemodel_1_k", "duplicate", "reorder", "reorder_ms", "rate_bps", "queue_bytes",
]  # fmt: skip


def built(**fields: Any) -> DirectionSettings:
    """Settings whose fields the type checker need not know."""
    return DirectionSettings(**fields)


def test_the_queue_is_chosen_by_rate_and_delay_where_none_is_given():
    assert DirectionSettings(delay_ms=300, rate_bps=8e6).queue_limit_bytes == 600_000
    assert DirectionSettings(delay_ms=670, rate_bps=9600).queue_limit_bytes == 4096
    assert DirectionSettings(delay_ms=300).queue_limit_bytes == 4 * 2**20
    assert DirectionSettings(delay_ms=300, rate_bps=8e6, queue_bytes=10).queue_limit_bytes == 10


@pytest.mark.parametrize("value", [-1.0, math.nan, math.inf, 1e300])
@pytest.mark.parametrize("field", NUMBERS)
def test_a_value_out_of_range_is_refused_by_name(field, value):
    with pytest.raises(ValueError, match=field):
        built(**{field: value})


@pytest.mark.parametrize("field", ["correlation", "loss", "duplicate", "reorder", "gemodel_1_h"])
def test_no_share_exceeds_a_hundred_per_cent(field):
    with pytest.raises(ValueError, match=f"{field} must be a finite number from 0 to 100"):
        built(**{field: 100.1})


@pytest.mark.parametrize(
    ("fields", "says"),
    [
        ({"delay_ms": 10, "jitter_ms": 11}, r"jitter_ms .* must not exceed delay_ms"),
        ({"delay_ms": 10, "jitter_ms": 1, "distribution": "none"}, 'distribution must not be "none"'),
        ({"rate_bps": 0.5}, "at least 1 bit/s"),
        ({"loss": 1, "gemodel_p": 1}, "two models of the same thing"),
        ({"gemodel_p": 1, "gemodel_r": 0}, "stays bad for ever"),
        ({"gap": 0}, "gap must be at least 1"),
    ],
)
def test_settings_that_contradict_each_other_are_refused(fields, says):
    with pytest.raises(ValueError, match=says):
        DirectionSettings(**fields)


@pytest.mark.parametrize("field", ["loss", "gemodel_p", "duplicate", "corrupt", "reorder"])
@pytest.mark.parametrize("direction", ["uplink", "downlink"])
def test_what_tcp_would_repair_is_named(direction, field):
    settings = LinkSettings(**{direction: built(**{field: 2})})
    assert settings.beyond_streams() == [f"{direction}.{field}"]


def test_a_tcp_connection_obeys_all_the_rest():
    line = DirectionSettings(
        delay_ms=300, jitter_ms=20, correlation=50, distribution="pareto", rate_bps=1e6, seed=3
    )
    assert LinkSettings(uplink=line, downlink=line).beyond_streams() == []
