"""Pictures have their share of the link, and no more: by its known rate, and by what it turns out to carry."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st

from farhand.common.link.budget import LEAST_PICTURE_BPS, OVERHEAD_BYTES
from farhand.common.wire.codec import encode
from farhand.common.wire.messages import MAX_PICTURE_BYTES, CameraPicture, CameraRequest, PictureView, Stamp
from farhand.common.wire.reason_words import sentence
from farhand.remote_site.camera.picture_plan import (
    LAPSES_S,
    LEAST_HZ,
    MOST_BYTES,
    MOST_HZ,
    CameraFailed,
    LinkEstimate,
    PicturePlan,
    fit_pictures,
)

SHARE = 0.25
many = settings(deadline=None, derandomize=True, max_examples=200)
rates = st.floats(LEAST_PICTURE_BPS, 1e9)


def on_the_wire(n_bytes: int) -> int:
    """Bytes of a picture's message with everything that it may have."""
    one = -1.0 / 3.0
    view = PictureView((one, one, one, one, one, one, one), 1e5 / 3.0, (-one * 1e6, one * 1e6))
    stamp = Stamp("f" * 8, 2**63 - 1)
    picture = CameraPicture(
        seq=2**40, stamp=stamp, width_px=4096, height_px=4096, jpeg=bytes(n_bytes), view=view, taken_s=0.1
    )
    return len(encode(picture)) + OVERHEAD_BYTES


@given(rate_bps=rates)
@many
def test_pictures_of_the_largest_size_keep_within_a_quarter_of_any_link(rate_bps: float):
    fit = fit_pictures(rate_bps)
    assert fit is not None
    assert on_the_wire(fit.most_bytes) / fit.period_s <= SHARE * rate_bps / 8 + 1e-6
    assert LEAST_HZ - 1e-9 <= 1.0 / fit.period_s <= MOST_HZ + 1e-9
    assert 1000 <= fit.most_bytes <= MOST_BYTES <= MAX_PICTURE_BYTES


@given(slow=rates, fast=rates)
@many
def test_a_faster_link_has_pictures_that_are_neither_rarer_nor_worse(slow: float, fast: float):
    less, more = fit_pictures(min(slow, fast)), fit_pictures(max(slow, fast))
    assert less is not None and more is not None
    assert more.period_s <= less.period_s + 1e-9
    assert more.most_bytes >= less.most_bytes - 1  # rounded to whole bytes


@given(rate_bps=st.floats(1.0, LEAST_PICTURE_BPS, exclude_max=True))
@many
def test_a_link_of_less_than_30_kbit_s_carries_no_pictures(rate_bps: float):
    assert fit_pictures(rate_bps) is None
    plan = PicturePlan(rate_bps)
    plan.asked(CameraRequest(session="page"), 0.0)
    assert not plan.sends(0.0) and plan.due(0.0)[0] is None
    assert plan.due(1000.0)[0] is None, "the configured rate does not change"


def test_at_9600_bit_s_the_reason_is_told():
    plan = PicturePlan(9600.0)
    assert sentence(plan.why_none(0.0)) == "the link carries 9.6 kbit/s, pictures need 30"


def test_the_link_of_a_satellite_has_3_pictures_a_second_and_60_kbit_s_one_every_2_s():
    geo, narrow = fit_pictures(10e6), fit_pictures(60e3)
    assert geo is not None and narrow is not None
    assert geo.period_s <= 1 / 3 + 1e-9 and narrow.period_s <= 2.0 and narrow.most_bytes >= 2000


def late_on(carried_bps: float, estimate: LinkEstimate, now_s: float) -> float:
    """Excess of a picture's transit on a link that carries so much for pictures, when a queue has built up if it can."""
    fit = estimate.fit(now_s)
    if fit is None:
        return 0.0
    sent_bps = 8.0 * fit.most_bytes / fit.period_s
    queue_s = 3.0 if sent_bps > carried_bps else 0.0
    return 8.0 * fit.most_bytes / carried_bps + queue_s


@given(carried_bps=st.floats(8e3, 2e6))
@many
def test_on_a_link_of_unknown_rate_pictures_make_way_within_seconds(carried_bps: float):
    """`carried_bps` is left over by everything else; the share of the pictures must come to lie below it."""
    estimate = LinkEstimate(0.0)
    for second in range(60):
        estimate.update(late_on(carried_bps, estimate, second), second)
    sent = []
    for second in range(60, 120):
        fit = estimate.fit(second)
        sent.append(8.0 * fit.most_bytes / fit.period_s if fit is not None else 0.0)
        estimate.update(late_on(carried_bps, estimate, second), second)
    assert sum(sent) / len(sent) <= 1.05 * carried_bps


def test_a_link_that_was_too_narrow_for_a_while_is_tried_again():
    estimate = LinkEstimate(40e3)
    for second in range(3):
        estimate.update(10.0, second)
    assert estimate.fit(3.0) is None and "pictures need 30" in sentence(estimate.why_none)
    assert estimate.fit(30.0) is not None
    for second in range(31, 60):
        estimate.update(0.0, second)
    assert estimate.rate_bps == 40e3


def test_pictures_that_are_a_little_late_become_rarer_and_do_not_end():
    estimate = LinkEstimate(60e3)
    for second in range(30):
        estimate.update(1.2, second)
        assert estimate.fit(second) is not None
    assert estimate.rate_bps == LEAST_PICTURE_BPS


def test_pictures_are_taken_only_while_somebody_looks():
    plan = PicturePlan(0.0)
    assert plan.due(0.0)[0] is None
    plan.asked(CameraRequest(session="page"), 10.0)
    fit, _ = plan.due(10.0)
    assert fit is not None
    plan.sent(fit, 10.0)
    early, wait_s = plan.due(10.1)
    assert early is None and abs(wait_s - (fit.period_s - 0.1)) < 1e-6
    assert plan.due(10.0 + fit.period_s + 1e-6)[0] is not None
    assert plan.due(10.1 + LAPSES_S)[0] is None


def test_the_pauses_after_faults_double_up_to_half_a_minute_and_a_lasting_one_ends_the_attempts():
    plan, now_s, pauses_s = PicturePlan(0.0), 0.0, []
    for _ in range(7):
        plan.asked(CameraRequest(session="page"), now_s)
        plan.failed(CameraFailed("the cable is unplugged"), now_s)
        pauses_s.append(plan.due(now_s)[1])
        assert plan.sends(now_s) and sentence(plan.why_none(now_s)) == "the cable is unplugged"
        now_s += 60.0
    assert pauses_s == [1, 2, 4, 8, 16, 30, 30]
    plan.failed(CameraFailed("nothing to draw with", lasting=True), now_s)
    plan.asked(CameraRequest(session="page"), now_s + 100)
    assert not plan.sends(now_s + 100) and plan.due(now_s + 100)[0] is None
