"""What the page says above the operator's arm."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from farhand.common.model.task_frame import TaskFrame
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.view.panels.words.tasks import local_words, words_of
from farhand.local_site.workcell.arm_view import ArmView
from farhand.local_site.workcell.held_arm import HeldArm
from tests.cells import JACO
from tests.local_site.robot_end import HOT_STAB, TASK

WORDS = words_of(HOT_STAB)
AT_REST = HeldArm("insert", JACO, 0).view()


def told(picture: ConsoleState, arm: ArmView) -> str:
    """The words, without their colours."""
    return re.sub("<[^>]+>", "", local_words(replace(picture, own_arm=arm), WORDS))


@pytest.mark.parametrize(
    ("depth_m", "lateral_m", "saturated", "words"),
    [
        (-0.300, 0.500, True, "the arm cannot follow there"),
        (0.083, 0.001, False, "83 mm deep, 9° askew"),
        (0.046, 0.005, True, "46 mm deep, jammed: 9° askew"),
    ],
)
def test_while_it_is_led_it_is_told_how_deep_the_plug_is_and_what_it_cannot_do(
    nothing_yet: ConsoleState, depth_m: float, lateral_m: float, saturated: bool, words: str
):
    tilt_rad = 0.157
    arm = replace(
        AT_REST, depth_m=depth_m, lateral_m=lateral_m, tilt_rad=tilt_rad, saturated=saturated, held=True
    )
    assert told(nothing_yet, arm) == words


@pytest.mark.parametrize(("depth_m", "side"), [(-0.034, "34 mm away"), (0.060, "60 mm past")])
def test_what_is_told_of_a_plug_outside_leads_each_arrow_to_the_bore(
    nothing_yet: ConsoleState, depth_m: float, side: str
):
    beside = TaskFrame.at(AT_REST.receptacle).to_world(np.array([0.112, -0.045, depth_m]))
    tip = np.concatenate([beside, AT_REST.receptacle[3:]])
    arm = replace(AT_REST, tip=tip, depth_m=depth_m, lateral_m=0.12, tilt_rad=0.0, held=True)
    assert told(nothing_yet, arm) == f"{side}, red -112, green +45, 0° askew"


def test_at_rest_it_is_only_told_while_something_is_recorded_or_the_plug_is_in(nothing_yet: ConsoleState):
    beside = replace(AT_REST, depth_m=0.083, lateral_m=0.2)
    assert told(nothing_yet, beside) == WORDS.own
    assert "mm past" in told(replace(nothing_yet, recording=True), beside)
    assert "83 mm deep" in told(nothing_yet, replace(beside, lateral_m=0.001))
    assert local_words(replace(nothing_yet, recording=True), words_of(TASK)) == words_of(TASK).recording
