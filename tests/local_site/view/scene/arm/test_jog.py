"""The hand moved by keys and a gamepad: lines of the tab in, poses and steps of the hand out, in virtual time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import structs

from farhand.common.mode_table import ControlMode
from farhand.local_site.console import intents
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.view.scene.arm.jog import Jog
from farhand.local_site.view.scene.hand_keys import SILENT_HERE_S, SILENT_S, HandLine
from farhand.local_site.workcell.hand_motion import hand_axes
from farhand.local_site.workcell.held_arm import HeldArm
from tests.cells import JACO
from tests.local_site.view.panels.test_truth import ROBOT_IN

ARM = HeldArm("insert", JACO, 0).view()
AXES = hand_axes(ARM.receptacle)
PERIOD_S = 1.0 / 30.0
FASTEST_M_S = 0.08


class Hand:
    """A jog whose arm does not follow, with all that it led and asked for."""

    def __init__(self, state: ConsoleState, turns: bool = False):
        self.state = replace(state, own_arm=ARM, recording=True)
        self.led: list[tuple[str, np.ndarray]] = []
        self.steps: list[intents.StepArm] = []
        self.jog = Jog(lambda phase, pose: self.led.append((phase, pose)), self._ask, lambda: turns)
        self.now_s = 100.0
        self.jog.step(self.state, self.now_s)

    def _ask(self, intent: intents.Intent) -> None:
        assert isinstance(intent, intents.StepArm)
        self.steps.append(intent)

    def hear(self, text: str) -> None:
        self.jog.hear(text, self.now_s)

    def wait(self, duration_s: float, text: str = "") -> None:
        for _ in range(round(duration_s / PERIOD_S)):
            self.now_s += PERIOD_S
            if text:
                self.hear(text)
            self.jog.step(self.state, self.now_s)

    def couple(self) -> None:
        robot = structs.replace(
            ROBOT_IN,
            mode=ControlMode.DIRECT,
            frame_origin_m=(0.8, 0.0, 0.3),
            frame_rotation_rad=(0.0, 1.5, 0.0),
        )
        self.state = replace(self.state, robot=robot, recording=False)


@pytest.fixture
def hand(nothing_yet: ConsoleState) -> Hand:
    return Hand(nothing_yet)


def test_while_it_is_held_the_hand_moves_evenly_and_no_faster_than_its_limit(hand: Hand):
    hand.couple()  # so that it is not held back near the arm
    axes = hand_axes(np.array([0.8, 0.0, 0.3, *(np.cos(0.75), 0.0, np.sin(0.75), 0.0)]))
    hand.wait(1.0, "a;0,0,0;1;0.00,0.00,1.00;7")
    way = np.diff([pose[:3] for _, pose in hand.led], axis=0)
    np.testing.assert_allclose(
        way, np.broadcast_to(FASTEST_M_S * PERIOD_S * axes[:, 2], way.shape), atol=1e-6
    )


def test_released_it_stops_at_once_and_says_so(hand: Hand):
    hand.wait(0.2, "a;0,0,0;1;1.00,0.00,0.00;1")
    hand.wait(0.1, "a;0,0,0;0;0.00,0.00,0.00;2")
    assert [phase for phase, _ in hand.led][-1] == "end"
    n = len(hand.led)
    hand.wait(1.0)
    assert len(hand.led) == n


@pytest.mark.parametrize(("coupled", "silent_s"), [(True, SILENT_S), (False, SILENT_HERE_S)])
def test_a_tab_that_falls_silent_lets_go(hand: Hand, coupled: bool, silent_s: float):
    if coupled:
        hand.couple()
    hand.wait(0.2, "a;0,0,0;1;1.00,0.00,0.00;1")
    n = len(hand.led)
    hand.wait(2.0)
    assert hand.led[-1][0] == "end"
    assert len(hand.led) - n <= round(silent_s / PERIOD_S) + 2
    hand.wait(0.2, "a;0,0,0;1;1.00,0.00,0.00;9")  # and what is heard again moves it again
    assert hand.led[-1][0] == "update"


def test_the_hand_stays_near_an_arm_that_is_held_up(hand: Hand):
    hand.wait(3.0, "a;0,0,0;1;0.00,0.00,1.00;1")
    away_m = np.linalg.norm([pose[:3] - ARM.tip[:3] for _, pose in hand.led], axis=1)
    assert 0.02 < away_m.max() < 0.026


def test_what_moved_one_arm_never_moves_the_other_before_it_was_released(hand: Hand):
    hand.wait(0.2, "a;0,0,0;1;1.00,0.00,0.00;1")
    hand.couple()
    hand.wait(0.5, "a;0,0,0;1;1.00,0.00,0.00;2")
    assert hand.led[-1][0] == "end"
    hand.wait(0.1, "a;0,0,0;0;0.00,0.00,0.00;3")
    hand.wait(0.1, "a;0,0,0;1;1.00,0.00,0.00;4")
    assert hand.led[-1][0] == "update"


def test_a_line_that_was_swallowed_loses_no_step(hand: Hand):
    for text in (
        "a;5,0,0;0;0.00,0.00,0.00;1",
        "a;15,0,0;0;0.00,0.00,0.00;3",
        "a;15,0,0;0;0.00,0.00,0.00;4",
        "b;0,0,-1;0;0.00,0.00,0.00;5",
    ):
        hand.hear(text)
        hand.wait(PERIOD_S)
    moved = np.array([step.nudge.move_m for step in hand.steps])
    np.testing.assert_allclose(
        moved, [0.005 * AXES[:, 0], 0.010 * AXES[:, 0], -0.001 * AXES[:, 2]], atol=1e-12
    )


def test_no_step_is_asked_for_while_nothing_is_recorded_or_the_hand_drives(hand: Hand):
    hand.couple()
    hand.hear("a;5,0,0;0;0.00,0.00,0.00;1")
    hand.wait(0.1)
    hand.state = replace(hand.state, robot=None)
    hand.hear("a;10,0,0;0;0.00,0.00,0.00;2")
    hand.wait(0.1)
    assert hand.steps == []


def test_on_request_five_steps_turn_by_one_degree_to_the_right_up_and_about_the_axis(
    nothing_yet: ConsoleState,
):
    hand = Hand(nothing_yet, turns=True)
    hand.hear("a;5,0,0;0;0.00,0.00,0.00;1")
    hand.wait(0.1)
    (step,) = hand.steps
    front = np.cross(step.nudge.turn_rad, AXES[:, 2])  # of a plug along the bore
    np.testing.assert_allclose(front, np.radians(1.0) * AXES[:, 0], atol=1e-9)
    assert step.nudge.move_m == (0.0, 0.0, 0.0)
    hand.wait(0.5, "a;5,0,0;1;0.00,1.00,0.00;2")
    assert all(np.array_equal(pose[:3], ARM.tip[:3]) for _, pose in hand.led)


@given(st.text(max_size=60))
def test_other_text_is_no_line(text: str):
    assert HandLine.parse(text) is None or text.count(";") == 4


def test_a_line_says_no_more_than_full_speed():
    line = HandLine.parse("a;1,-2,3;1;1.99,-1.99,0.50;1")
    assert line is not None and line.held
    np.testing.assert_array_equal(line.speed, [1.0, -1.0, 0.5])
    np.testing.assert_array_equal(line.steps, [1, -2, 3])
