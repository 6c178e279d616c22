"""While an arm is taught: what the gauge shows of its plug, and what the action line advises next."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from farhand.common.model.task_frame import TaskFrame
from farhand.deploy.places import find_task
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.view.panels import buttons
from farhand.local_site.view.panels.hand_panel import beside_axis, gauge_html
from farhand.local_site.view.panels.words.advice import advice
from farhand.local_site.workcell.arm_view import ArmView
from farhand.local_site.workcell.held_arm import HeldArm
from tests.cells import JACO
from tests.local_site.robot_end import HOT_STAB
from tests.local_site.view.panels.test_truth import ROBOT_IN

AT_REST = HeldArm("insert", JACO, 0).view()
REMOVAL = find_task("hot-stab-removal")


def plug(x_m: float, y_m: float, depth_m: float, still: bool = True) -> ArmView:
    """The arm with its plug there in front of the receptacle, or in it, and along the bore."""
    place = TaskFrame.at(AT_REST.receptacle).to_world(np.array([x_m, y_m, depth_m]))
    tip = np.concatenate([place, AT_REST.receptacle[3:]])
    return replace(
        AT_REST, tip=tip, depth_m=depth_m, lateral_m=float(np.hypot(x_m, y_m)), tilt_rad=0.0, still=still
    )


@pytest.fixture
def teaching(nothing_yet: ConsoleState) -> ConsoleState:
    return replace(nothing_yet, task=HOT_STAB, robot=ROBOT_IN, recording=True)


def words(html: str) -> str:
    return " ".join(re.sub("<[^>]+>", " ", html).split())


@pytest.mark.parametrize(
    ("arm", "told"),
    [
        (plug(0.112, -0.045, -0.034), "34 mm to go to the mouth 121 mm beside 0° askew"),
        (plug(0.0, 0.001, 0.046), "46 of 85 mm deep 1 mm beside 0° askew"),
    ],
)
def test_the_gauge_tells_depth_distance_beside_and_tilt(teaching: ConsoleState, arm: ArmView, told: str):
    html = gauge_html(replace(teaching, own_arm=arm), turns=False)
    assert told in words(html)
    assert "Move by keys: 5 mm, with Shift 1 mm" in words(html)
    assert "Turn by keys: 1°" in words(gauge_html(replace(teaching, own_arm=arm), turns=True))


def test_beside_the_axis_is_to_the_right_and_up_as_seen_from_behind():
    """Of this receptacle x is to the right and y is down."""
    np.testing.assert_allclose(beside_axis(plug(0.112, -0.045, -0.034)), [0.112, 0.045], atol=1e-9)


def test_without_a_recording_or_an_arm_no_gauge_is_drawn(teaching: ConsoleState):
    assert gauge_html(replace(teaching, own_arm=plug(0.0, 0.0, 0.0), recording=False), turns=False) == ""
    assert gauge_html(replace(teaching, own_arm=None), turns=False) == ""


@pytest.mark.parametrize(
    ("arm", "next_step"),
    [
        (plug(0.2, 0.1, -0.2), "Drag the arrows at your own plug to the front of the receptacle"),
        (plug(0.05, 0.02, -0.12), "Press Centre"),
        (plug(0.0, 0.0, -0.12), "On the axis: hold the key I"),
        (plug(0.0, 0.0, 0.040), "Push on, by the blue arrow or the key I: 45 mm to go."),
        (plug(0.0, 0.0, 0.080, still=False), "Push on"),
        (
            plug(0.0, 0.0, 0.084, still=False),
            "At the bottom: let go. Once the plug stands still, End turns green.",
        ),
        (plug(0.0, 0.0, 0.084), "Seated: press End."),
    ],
)
def test_the_advice_leads_to_the_seat(teaching: ConsoleState, arm: ArmView, next_step: str):
    state = replace(teaching, own_arm=arm)
    assert advice(state).startswith(next_step)
    assert buttons.END.ready(state) is next_step.startswith("Seated")


@pytest.mark.parametrize(("depth_m", "out"), [(0.084, False), (-0.02, False), (-0.12, True)])
def test_a_plug_is_taught_out_until_it_stands_well_before_the_mouth(
    teaching: ConsoleState, depth_m: float, out: bool
):
    state = replace(teaching, task=REMOVAL, own_arm=plug(0.0, 0.0, depth_m))
    assert (advice(state) == "Out of the receptacle: press End.") is out
