"""The operator's arm led by a hand: turned along the bore, then pushed in by its arrows."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from farhand.common.model.task_frame import TaskFrame
from farhand.local_site.workcell import hand_motion
from farhand.local_site.workcell.held_arm import HeldArm
from tests.cells import JACO

ASKEW = (3, 9)
"""With these seeds the plug is 24 and 12 degrees askew at first: it would jam at the mouth."""
TURN_S = 4.0


def wait(arm: HeldArm, duration_s: float) -> None:
    for _ in range(round(duration_s * 100)):
        arm.tick()


def align(arm: HeldArm) -> None:
    arm.lead(hand_motion.align)
    for _ in range(round(TURN_S * 100)):
        if arm.held:
            arm.tick()
    assert not arm.held


def drag(arm: HeldArm, axis: int, length_m: float, wait_s: float = 1.0, n_events: int = 8) -> None:
    """Take an arrow at the plug where that is now, drag it along itself, wait, and let go."""
    tip = arm.view().tip
    for part in np.linspace(0.0, 1.0, n_events + 1)[1:]:
        target = tip.copy()
        target[:3] += part * length_m * TaskFrame.at(tip).A[:3, axis]
        arm.hold(target)
        wait(arm, 0.05)
    wait(arm, wait_s)
    arm.let_go()


@pytest.mark.parametrize("seed", ASKEW)
def test_an_aligned_plug_points_along_the_bore_and_three_arrows_aimed_badly_lead_it_to_its_seat(seed: int):
    arm = HeldArm("insert", JACO, seed)
    before = arm.view()
    assert before.tilt_rad > np.radians(10.0)
    align(arm)
    after = arm.view()
    assert after.tilt_rad < np.radians(0.5)
    assert np.linalg.norm(after.tip[:3] - before.tip[:3]) < 2e-3
    np.testing.assert_allclose(arm.take().points[-1], after.tip, atol=1e-3)  # whoever records has it too
    # Its arrows are the receptacle's now: two of them put right what is beside.
    np.testing.assert_allclose(TaskFrame.at(after.tip).A, TaskFrame.at(after.receptacle).A, atol=0.01)
    for axis, missed_m, wait_s in ((0, 0.010, 1.0), (1, -0.010, 1.0), (2, 0.10, 4.0)):
        way_m = TaskFrame.at(arm.view().tip).to_local(arm.view().receptacle)[axis]
        drag(arm, axis, float(way_m) + missed_m, wait_s)
    assert arm.view().depth_m > 0.080 and arm.view().lateral_m < 0.004


def test_an_askew_plug_jams_and_says_so_and_aligned_there_it_goes_in():
    arm = HeldArm("insert", JACO, 9)
    target = arm.view().tip
    target[:3] = TaskFrame.at(arm.view().receptacle).to_world(np.array([0.0, 0.0, 0.12]))
    arm.hold(target)
    wait(arm, 3.0)
    jammed = arm.view()
    assert jammed.saturated and 0.01 < jammed.depth_m < 0.06
    align(arm)
    drag(arm, 2, 0.10, wait_s=2.0)
    assert arm.view().depth_m > 0.080


def test_a_hand_takes_over_from_a_plug_that_turns():
    arm = HeldArm("insert", JACO, 3)
    arm.lead(hand_motion.align)
    wait(arm, 0.2)
    there = arm.view().tip
    arm.hold(there)
    wait(arm, 1.0)
    assert arm.view().held and np.allclose(arm.view().tip, there, atol=5e-3)


def lead(arm: HeldArm, motion: hand_motion.HandMotion) -> None:
    arm.lead(motion)
    for _ in range(round(12.0 * 100)):
        if arm.held:
            arm.tick()
    assert not arm.held


def test_a_step_is_recorded_as_an_even_motion_and_steps_add_up():
    arm = HeldArm("insert", JACO, 2)
    before = arm.view()
    up = hand_motion.hand_axes(before.receptacle)[:, 1]
    for _ in range(3):
        arm.lead(hand_motion.Nudge(tuple(0.005 * up)))
    wait(arm, 3.0)
    assert not arm.held
    np.testing.assert_allclose(arm.view().tip[:3] - before.tip[:3], 0.015 * up, atol=5e-4)
    np.testing.assert_allclose(arm.view().tip[3:], before.tip[3:], atol=2e-3)
    steps_m = np.linalg.norm(np.diff(arm.take().points[:, :3], axis=0), axis=1)
    assert steps_m.max() < 0.06 * 0.01, "never faster than the hand"


def test_a_turn_leaves_the_tip_where_it_is():
    arm = HeldArm("insert", JACO, 2)
    before = arm.view()
    lead(arm, hand_motion.Nudge((0.0, 0.0, 0.0), tuple(np.radians(5.0) * TaskFrame.at(before.tip).A[:3, 0])))
    turned = Rotation.from_quat([before.tip[3:], arm.view().tip[3:]], scalar_first=True)
    assert (turned[0].inv() * turned[1]).magnitude() == pytest.approx(np.radians(5.0), abs=2e-3)
    assert np.linalg.norm(arm.view().tip[:3] - before.tip[:3]) < 1e-3


@pytest.mark.parametrize("seed", [0, 2, 6, 7])
def test_centred_before_the_mouth_one_push_seats_the_plug(seed: int):
    arm = HeldArm("insert", JACO, seed)
    before = arm.view()
    assert hand_motion.can_centre(before)
    lead(arm, hand_motion.centre)
    on_axis = arm.view()
    assert on_axis.lateral_m < 1e-3 and on_axis.tilt_rad < np.radians(0.5)
    assert on_axis.depth_m == pytest.approx(before.depth_m, abs=2e-3)
    assert not hand_motion.can_centre(on_axis)
    into = hand_motion.hand_axes(before.receptacle)[:, 2]
    lead(arm, hand_motion.Nudge(tuple((on_axis.bore_m - on_axis.depth_m) * into)))
    wait(arm, 0.5)
    assert arm.view().depth_m > 0.080 and arm.view().still


@given(st.floats(-180.0, 180.0), st.floats(-40.0, 40.0), st.floats(-180.0, 180.0))
def test_right_and_up_are_as_a_person_behind_the_arm_sees_them(heading: float, pitch: float, roll: float):
    turn = Rotation.from_euler("ZYX", [heading, pitch, roll], degrees=True) * Rotation.from_euler(
        "Y", 90.0, degrees=True
    )
    right, up, into = hand_motion.hand_axes(np.concatenate([np.zeros(3), turn.as_quat(scalar_first=True)])).T
    np.testing.assert_allclose(into, turn.as_matrix()[:, 2], atol=1e-9)
    np.testing.assert_allclose(np.cross(into, up), right, atol=1e-9)
    assert up[2] >= 0.5  # 45 degrees of roll and 40 of pitch at most


def test_also_the_smallest_step_is_made_whole():
    arm = HeldArm("insert", JACO, 2)
    before = arm.view()
    lead(arm, hand_motion.Nudge((0.0, 0.001, 0.0)))
    wait(arm, 2.0)
    np.testing.assert_allclose(arm.view().tip[:3] - before.tip[:3], [0.0, 0.001, 0.0], atol=2e-4)


def test_the_rests_between_steps_are_no_part_of_the_motion():
    arm = HeldArm("insert", JACO, 2)
    up = 0.005 * hand_motion.hand_axes(arm.view().receptacle)[:, 1]
    for _ in range(4):
        lead(arm, hand_motion.Nudge(tuple(up)))
        wait(arm, 5.0)
    moved = arm.take()
    assert moved.times_s[-1] < 4 * 1.8, "of more than 20 s"
    assert np.linalg.norm(np.diff(moved.points[:, :3], axis=0), axis=1).max() < 1.5e-3, "nothing jumps"
    assert np.linalg.norm(moved.points[-1, :3] - moved.points[0, :3]) == pytest.approx(0.020, abs=1e-3)


def test_a_plug_is_still_in_its_seat_also_while_the_hand_goes_on_pushing():
    arm = HeldArm("insert", JACO, 2)
    lead(arm, hand_motion.centre)
    beyond = arm.view().tip
    beyond[:3] = TaskFrame.at(arm.view().receptacle).to_world(np.array([0.0, 0.0, 0.10]))
    for _ in range(500):
        arm.hold(beyond)  # as often as a held key says so
        arm.tick()
    assert arm.view().held and arm.view().still and arm.view().depth_m > 0.080
