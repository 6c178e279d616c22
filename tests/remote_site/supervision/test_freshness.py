from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from farhand.common.clock import BootClock
from farhand.common.wire.messages import Stamp
from farhand.evaluation.harness.steered_world import SteppedTime
from farhand.remote_site.supervision.freshness import Freshness
from tests.messages import said


class Ages:
    """Judges by age in place of stamps."""

    def __init__(self, max_age_s: float = 15.0, telemetry_period_s: float = 0.04):
        self.time = SteppedTime()
        self.freshness = Freshness(BootClock("boot", self.time), max_age_s, telemetry_period_s)

    def echo(self, age_s: float) -> Stamp:
        return Stamp("boot", self.time.ns - round(age_s * 1e9))

    def accepts(self, age_s: float, ttl_max_s: float | None = None) -> bool:
        return not self.freshness.judge(self.echo(age_s), ttl_max_s).reason

    def renew(self, age_s: float, after_s: float = 1.0) -> bool:
        self.time.advance(after_s)
        return not self.freshness.renew(self.echo(age_s)).reason


def test_before_the_first_renewal_only_the_largest_age_counts():
    ages = Ages()
    assert ages.freshness.reference_s is None
    assert ages.accepts(14.9) and not ages.accepts(15.1)


@pytest.mark.parametrize(
    ("echo", "words"),
    [
        (None, "no report"),
        (Stamp("another", 0), "another boot"),
        (Stamp("boot", 10**12), "never sent"),
    ],
)
def test_what_is_not_a_past_stamp_of_this_boot_is_refused(echo: Stamp | None, words: str):
    assert words in said(Ages().freshness.judge(echo))
    assert words in said(Ages().freshness.renew(echo))


@settings(deadline=None, derandomize=True, max_examples=100)
@given(usual_s=st.floats(0.0, 5.0), spread_s=st.floats(0.0, 0.8), extra_s=st.floats(0.0, 3.0))
def test_a_message_may_be_older_than_usual_by_the_spread_within_bounds(usual_s, spread_s, extra_s):
    ages = Ages()
    for age_s in (usual_s, usual_s + min(spread_s, 0.24)):
        assert ages.renew(age_s)
    assert ages.freshness.reference_s == pytest.approx(usual_s, abs=1e-8)
    if extra_s <= 0.249:
        assert ages.accepts(usual_s + extra_s)
    if extra_s >= 1.001:
        assert not ages.accepts(usual_s + extra_s)


def test_the_spread_widens_what_is_usual_but_not_beyond_one_second():
    ages = Ages()
    for extra_s in (0.0, 0.2, 0.25, 0.34, 0.43, 0.52, 0.61, 0.7, 0.79, 0.88):
        assert ages.renew(1.0 + extra_s)
    assert ages.accepts(1.95) and not ages.accepts(2.01)


def test_slow_telemetry_allows_commands_more_but_not_the_hand():
    slow, fast = Ages(telemetry_period_s=2.0), Ages(telemetry_period_s=0.04)
    for ages in (slow, fast):
        for age_s in (3.0, 1.0):  # the link's delay spreads over two seconds
            assert ages.renew(age_s)
    assert slow.accepts(5.0) and not slow.accepts(5.2)  # two reports that are 2 s apart, and 0.1 s
    assert not slow.accepts(2.01, ttl_max_s=1.0)
    assert not fast.accepts(2.01)


def test_nothing_is_ever_accepted_beyond_the_largest_age():
    ages = Ages(max_age_s=2.0)
    assert ages.renew(1.95)
    assert not ages.accepts(2.01)


def test_a_backlog_that_arrives_in_a_burst_teaches_nothing():
    ages = Ages()
    for _ in range(10):
        assert ages.renew(0.1)
    ages.time.advance(5.0)
    for n in range(30):
        assert not ages.renew(5.0 - 0.1 * n, after_s=0.01)
    assert ages.freshness.reference_s == pytest.approx(0.1)


def test_a_request_without_an_echo_is_not_the_begin_of_a_burst():
    ages = Ages()
    ages.freshness.renew(None)  # a site that has not heard the robot yet; it has 0.2 s later
    assert ages.renew(0.42, after_s=0.2)
    assert ages.freshness.reference_s == pytest.approx(0.42)


def test_a_lasting_rise_of_the_delay_becomes_usual_after_ten_renewals():
    ages = Ages()
    for _ in range(10):
        assert ages.renew(0.1)
    ages.time.advance(3.0)  # on a link that keeps the order, what comes later never echoes something older
    for _ in range(10):
        assert not ages.accepts(3.0)
        ages.renew(3.0)
    assert ages.accepts(3.0)
    assert ages.freshness.reference_s == pytest.approx(3.0)


def test_renewals_that_do_not_agree_or_are_too_old_never_become_usual():
    scattered, ancient = Ages(), Ages()
    for n in range(30):
        scattered.renew(0.1 if n == 0 else 3.0 + 2.0 * (n % 2))
        ancient.renew(0.1 if n == 0 else 16.0)
    assert scattered.freshness.reference_s == pytest.approx(0.1)
    assert ancient.freshness.reference_s == pytest.approx(0.1)


def test_a_shorter_delay_is_usual_at_once():
    ages = Ages()
    ages.renew(2.0)
    ages.renew(0.1)
    assert ages.freshness.reference_s == pytest.approx(0.1)
    assert not ages.accepts(1.2)
