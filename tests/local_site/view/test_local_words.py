"""What the page says above the operator's arm."""

from __future__ import annotations

from dataclasses import replace

import pytest

from local_site.held_arm import HeldArm
from local_site.picture import Picture
from local_site.view.local_words import local_words
from local_site.view.words import words_of
from tests.local_site.robot_end import HOT_STAB, TASK

WORDS = words_of(HOT_STAB)
AT_REST = HeldArm("insert", 0).view()


@pytest.mark.parametrize(
    ("depth_m", "lateral_m", "saturated", "words"),
    [
        (-0.034, 0.012, False, "34 mm away, 12 mm beside, 9° askew"),
        (0.060, 0.120, False, "60 mm past, 120 mm beside, 9° askew"),
        (-0.300, 0.500, True, "the arm cannot follow there"),
        (0.083, 0.001, False, "83 mm deep, 9° askew"),
        (0.046, 0.005, True, "46 mm deep, jammed: 9° askew"),
    ],
)
def test_while_it_is_led_the_plugs_place_is_told(
    nothing_yet: Picture, depth_m: float, lateral_m: float, saturated: bool, words: str
):
    arm = replace(
        AT_REST, depth_m=depth_m, lateral_m=lateral_m, tilt_rad=0.157, saturated=saturated, held=True
    )
    assert local_words(replace(nothing_yet, own_arm=arm), WORDS) == words


def test_at_rest_it_is_only_told_while_something_is_recorded_or_the_plug_is_in(nothing_yet: Picture):
    beside = replace(AT_REST, depth_m=0.083, lateral_m=0.2)
    assert local_words(replace(nothing_yet, own_arm=beside), WORDS) == WORDS.own
    assert "200 mm beside" in local_words(replace(nothing_yet, own_arm=beside, recording=True), WORDS)
    seated = replace(beside, lateral_m=0.001)
    assert "83 mm deep" in local_words(replace(nothing_yet, own_arm=seated), WORDS)
    assert local_words(replace(nothing_yet, recording=True), words_of(TASK)) == words_of(TASK).recording
