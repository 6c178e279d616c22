from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from farhand.remote_site.insertion.jams_and_retries import JamDetector, Stuck

TILTED = np.array([2.0, 0.0, 0.0])


def found(
    depth_m: Callable[[float], float],
    force_n: float = 40.0,
    aside_n: float = 0.0,
    torque_nm: np.ndarray = TILTED,
    for_s: float = 3.5,
) -> list[tuple[float, Stuck]]:
    detector, force = JamDetector(), np.array([aside_n, 0.0, -force_n])
    times = [0.01 * n for n in range(round(100 * for_s))]
    all_found = [(t, detector.stuck(depth_m(t), force, torque_nm, t)) for t in times]
    return [one for one in all_found if one[1] is not Stuck.NO]


def test_a_plug_that_presses_and_gets_no_further_is_jammed_about_once_a_second():
    when = found(lambda t: 0.03)
    assert all(what is Stuck.JAMMED for _, what in when)
    assert [t for t, _ in when] == pytest.approx([1.0, 2.01, 3.02], abs=0.03)


@pytest.mark.parametrize("depth_m", [-0.021, 0.071])
def test_before_the_mouth_and_where_it_should_be_nothing_is_stuck(depth_m: float):
    assert not found(lambda t: depth_m)


def test_one_that_goes_in_or_does_not_press_is_not_stuck():
    assert not found(lambda t: -0.01 + 0.002 * t)
    assert not found(lambda t: 0.03, force_n=14.0)


def test_one_that_is_pushed_out_is_jammed_too():
    assert found(lambda t: 0.06 - 0.01 * t)


def test_deep_in_the_bore_and_pressed_on_straight_it_is_at_the_bottom():
    straight = np.zeros(3)
    assert [what for _, what in found(lambda t: 0.06, torque_nm=straight, for_s=1.5)] == [Stuck.AT_BOTTOM]
    assert [what for _, what in found(lambda t: 0.03, torque_nm=straight, for_s=1.5)] == [Stuck.JAMMED]
    assert [what for _, what in found(lambda t: 0.06, aside_n=9.0, torque_nm=straight, for_s=1.5)] == [
        Stuck.JAMMED
    ]
    assert [what for _, what in found(lambda t: 0.06, for_s=1.5)] == [Stuck.JAMMED]
