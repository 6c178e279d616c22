from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from farhand.common.wire.messages import OperatorInput, Stamp
from farhand.common.wire.reason_words import sentence
from farhand.remote_site.motion.coupling import Coupling

ROBOT = np.array([0.4, 0.6])
coordinates = st.floats(-2.0, 2.0)


def an_input(seq: int, x: float, y: float, released: bool = False) -> OperatorInput:
    return OperatorInput(
        seq=seq, echo=Stamp("boot", 0), lease_id="l", coupling_id=1, position_m=(x, y), released=released
    )


def reference(coupling: Coupling, now_s: float) -> np.ndarray:
    at = coupling.reference(now_s)
    assert at is not None
    return at


def test_nothing_is_followed_before_the_first_input():
    coupling = Coupling(1, "l", 0.0)
    assert coupling.waiting(0.0) and coupling.reference(0.0) is None


@settings(deadline=None, derandomize=True, max_examples=50)
@given(x=coordinates, y=coordinates, dx=coordinates, dy=coordinates)
def test_the_first_input_anchors_and_differences_are_followed(x: float, y: float, dx: float, dy: float):
    coupling = Coupling(1, "l", 0.0)
    coupling.feed(an_input(1, x, y), ROBOT, 0.0)
    np.testing.assert_allclose(reference(coupling, 0.0), ROBOT, atol=1e-12)
    coupling.feed(an_input(2, x + dx, y + dy), ROBOT + 0.3, 0.1)
    np.testing.assert_allclose(reference(coupling, 0.1), ROBOT + np.array([dx, dy]), atol=1e-12)


def test_late_and_repeated_inputs_are_ignored():
    coupling = Coupling(1, "l", 0.0)
    coupling.feed(an_input(5, 0.0, 0.0), ROBOT, 0.0)
    coupling.feed(an_input(7, 0.2, 0.0), ROBOT, 0.1)
    for seq in (6, 7, 0):
        coupling.feed(an_input(seq, 0.9, 0.9, released=True), ROBOT, 0.2)
    np.testing.assert_allclose(reference(coupling, 0.2), ROBOT + np.array([0.2, 0.0]))
    assert not coupling.released


def test_an_input_of_another_dimension_is_ignored():
    coupling = Coupling(1, "l", 0.0)
    solid = OperatorInput(
        seq=1, echo=Stamp("boot", 0), lease_id="l", coupling_id=1, position_m=(0.0, 0.0, 0.0)
    )
    coupling.feed(solid, ROBOT, 0.0)
    assert coupling.reference(0.0) is None


def test_after_a_pause_of_the_hand_the_robot_goes_on_from_where_it_stopped():
    coupling = Coupling(1, "l", 0.0)
    coupling.feed(an_input(1, 0.0, 0.0), ROBOT, 0.0)
    assert not coupling.waiting(0.5) and coupling.waiting(0.51)
    stopped = ROBOT + 0.05
    coupling.stop_here(stopped)
    coupling.feed(an_input(2, 1.0, 1.0), stopped, 2.0)
    np.testing.assert_allclose(reference(coupling, 2.0), stopped)
    coupling.feed(an_input(3, 1.1, 1.0), stopped, 2.1)
    np.testing.assert_allclose(reference(coupling, 2.1), stopped + np.array([0.1, 0.0]))


def test_it_ends_when_the_hand_lets_go_or_is_gone_for_ten_seconds():
    coupling = Coupling(1, "l", 0.0)
    assert not coupling.end_reason(9.9) and "10 s" in sentence(coupling.end_reason(10.1))
    coupling.feed(an_input(1, 0.0, 0.0), ROBOT, 9.0)
    assert not coupling.end_reason(18.9)
    coupling.feed(an_input(2, 0.0, 0.0, released=True), ROBOT, 18.0)
    assert sentence(coupling.end_reason(18.0)) == "the drag ended"
    coupling.feed(an_input(3, 0.0, 0.0), ROBOT, 18.1)
    assert coupling.end_reason(18.1), "once let go it is over"


def test_the_ten_seconds_begin_when_the_first_input_can_be_there():
    coupling = Coupling(1, "l", 0.0, round_trip_s=10.4)
    assert not coupling.end_reason(20.3) and "10 s" in sentence(coupling.end_reason(20.5))
    coupling.feed(an_input(1, 0.0, 0.0), ROBOT, 10.5)
    assert coupling.waiting(11.1)  # the dead-man is as quick as ever


@pytest.mark.parametrize(("now_s", "scale"), [(4.9, 0.2), (5.0, 0.2), (5.99, 0.2), (6.01, 1.0)])
def test_the_first_second_of_driving_is_slow(now_s: float, scale: float):
    coupling = Coupling(1, "l", 0.0)
    if now_s >= 5.0:  # when the first input came, over a long link
        coupling.feed(an_input(1, 0.0, 0.0), ROBOT, 5.0)
    assert coupling.speed_scale(now_s) == scale
