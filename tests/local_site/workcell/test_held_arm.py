"""The operator's arm led by a hand: turned along the bore, then pushed in by its arrows."""

from __future__ import annotations

import numpy as np
import pytest

from farhand.common.model.task_frame import TaskFrame
from farhand.local_site.workcell.held_arm import HeldArm
from tests.cells import JACO

ASKEW = (3, 9)
"""With these seeds the plug is 24 and 12 degrees askew at first: it would jam at the mouth."""
TURN_S = 4.0


def wait(arm: HeldArm, duration_s: float) -> None:
    for _ in range(round(duration_s * 100)):
        arm.tick()


def align(arm: HeldArm) -> None:
    arm.align()
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
    arm.align()
    wait(arm, 0.2)
    there = arm.view().tip
    arm.hold(there)
    wait(arm, 1.0)
    assert arm.view().held and np.allclose(arm.view().tip, there, atol=5e-3)
