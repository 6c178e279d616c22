from __future__ import annotations

from collections.abc import Callable

import pytest

from remote_site.jam import JamDetector


def jams(depth_m: Callable[[float], float], force_n: float = 40.0, for_s: float = 3.5) -> list[float]:
    detector = JamDetector()
    return [
        0.01 * n for n in range(round(100 * for_s)) if detector.jammed(depth_m(0.01 * n), force_n, 0.01 * n)
    ]


def test_a_plug_that_presses_and_gets_no_further_is_jammed_once_a_second():
    assert jams(lambda t: 0.03) == pytest.approx([1.0, 2.01, 3.02])


@pytest.mark.parametrize("depth_m", [-0.021, 0.071])
def test_before_the_mouth_and_at_the_bottom_nothing_jams(depth_m: float):
    assert not jams(lambda t: depth_m)


def test_one_that_goes_in_or_does_not_press_is_not_jammed():
    assert not jams(lambda t: -0.01 + 0.002 * t)
    assert not jams(lambda t: 0.03, force_n=14.0)


def test_one_that_is_pushed_out_is_jammed_too():
    assert jams(lambda t: 0.06 - 0.01 * t)
