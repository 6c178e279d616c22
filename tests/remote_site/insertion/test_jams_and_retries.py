from __future__ import annotations

import numpy as np
import pytest

from farhand.common.model.task_frame import TaskFrame
from farhand.remote_site.insertion.contact_estimate import ContactWrench
from farhand.remote_site.insertion.jams_and_retries import MAX_ATTEMPTS, Recovery

SEEN = TaskFrame.at(np.array([0.8, 0.1, 0.4, 0.5, -0.5, 0.5, -0.5]))  # z of the receptacle is x of the world
ALIGNED = np.array([1.0, 0.0, 0.0, 0.0])


class Trial:
    """A plug that is where it is told to be, in the frame as seen, and goes back at 5 cm/s when it must."""

    def __init__(self, recovery: Recovery):
        self.recovery, self.time_s = recovery, 0.0
        self.local = np.array([0.0, 0.0, -0.1, *ALIGNED])
        self.force_n = np.zeros(3)
        self.goals: list[np.ndarray] = []

    def run(self, for_s: float, quiet: bool = True) -> None:
        for _ in range(round(100 * for_s)):
            felt = ContactWrench(SEEN.to_world(self.local), SEEN.A @ self.force_n, np.zeros(3))
            back = self.recovery.update(felt, SEEN, quiet, self.time_s, 0.01)
            self.time_s += 0.01
            if back is not None:
                goal = SEEN.to_local(back)
                self.goals.append(goal)
                way = goal[:3] - self.local[:3]
                self.local[:3] += way * min(1.0, 0.0005 / max(float(np.linalg.norm(way)), 1e-9))


def jammed(recovery: Recovery) -> Trial:
    trial = Trial(recovery)
    trial.local[:3], trial.force_n = (0.004, 0.0, 0.04), np.array([0.0, 0.0, -40.0])
    trial.run(1.05)
    return trial


def test_a_motion_that_goes_well_goes_on():
    trial = Trial(Recovery())
    trial.run(2.0)
    assert not trial.goals and trial.recovery.jams == 0


def test_a_jammed_plug_goes_back_three_centimetres_and_the_frame_to_where_it_was_jammed():
    trial = jammed(Recovery())
    assert trial.recovery.jams == 1
    np.testing.assert_allclose(trial.goals[0][:3], [0.004, 0.0, 0.01], atol=1e-9)
    np.testing.assert_allclose(trial.recovery.corrected([SEEN])[0].b, SEEN.to_world(np.array([0.0028, 0, 0])))
    trial.force_n[:] = 0.0
    trial.run(1.0)
    n = len(trial.goals)
    assert trial.local[2] == pytest.approx(0.01, abs=0.005)
    trial.run(0.5)
    assert len(trial.goals) == n  # it has gone on meanwhile


def test_a_plug_at_the_bottom_stays_there_and_the_frame_comes_nearer():
    trial = Trial(Recovery())
    trial.local[:3], trial.force_n = (0.0, 0.0, 0.06), np.array([0.0, 0.0, -40.0])
    trial.run(1.05)
    assert not trial.goals and trial.recovery.jams == 0
    corrected = trial.recovery.corrected([SEEN])[0]
    assert corrected.to_local(SEEN.to_world(trial.local))[2] == pytest.approx(0.085)


def test_without_the_correction_the_frame_stays_as_seen():
    trial = jammed(Recovery(correcting=False))
    assert trial.goals
    np.testing.assert_array_equal(trial.recovery.corrected([SEEN])[0].b, SEEN.b)


def test_after_four_attempts_it_is_given_up():
    recovery = Recovery()
    for attempt in range(MAX_ATTEMPTS + 1):
        assert recovery.jams == attempt and not recovery.given_up
        trial = Trial(recovery)
        trial.time_s = 20.0 * attempt
        trial.local[:3], trial.force_n = (0.0, 0.0, 0.04), np.array([0.0, 0.0, -40.0])
        trial.run(1.05)
        trial.force_n[:] = 0.0
        trial.run(3.0)
        assert bool(trial.goals) == (attempt < MAX_ATTEMPTS)
    assert recovery.given_up


def test_without_attempts_it_presses_on():
    recovery = Recovery(attempts=0)
    assert not jammed(recovery).goals and not recovery.given_up


def test_a_plug_beside_the_mouth_after_a_jump_goes_back_along_the_axis_without_what_it_felt():
    trial = Trial(Recovery())
    trial.local[:3], trial.force_n = (0.0, 0.0, -0.01), np.array([10.0, 0.0, 0.0])
    trial.run(0.2)
    assert trial.recovery.correction.shift_m[0] > 0.0
    trial.recovery.jumped()
    trial.local[:3], trial.force_n = (0.04, 0.02, 0.01), np.zeros(3)
    trial.run(0.01)
    np.testing.assert_allclose(trial.goals[0][:3], [0.04, 0.02, -0.09], atol=1e-9)
    assert not trial.recovery.correction.shift_m.any() and trial.recovery.retreats == 1


def test_a_goal_that_cannot_be_reached_is_given_up_after_a_while():
    trial = jammed(Recovery())
    trial.force_n[:] = 0.0
    trial.run(0.1)
    assert trial.goals
    held = trial.local.copy()
    n = 0
    for _ in range(500):
        trial.local = held.copy()
        before = len(trial.goals)
        trial.run(0.01)
        n += len(trial.goals) - before
    assert n < 450


def test_the_correction_moves_the_frame_that_the_controller_sees_and_no_other():
    trial = Trial(Recovery())
    trial.local[:3], trial.force_n = (0.0, 0.0, 0.01), np.array([5.0, 0.0, 0.0])
    trial.run(0.5)
    other = TaskFrame.identity(3)
    corrected = trial.recovery.corrected([other, SEEN])
    assert corrected[0] is other
    np.testing.assert_allclose(SEEN.to_local(corrected[1].b), [0.005, 0.0, 0.0], atol=1e-9)


def test_a_plug_that_is_to_come_out_says_where_the_bore_is_and_never_goes_back():
    trial = Trial(Recovery(enters=False))
    trial.local[:3], trial.force_n = (0.004, -0.002, 0.08), np.array([0.0, 0.0, 40.0])
    trial.recovery.begin(SEEN.to_world(trial.local), SEEN)
    corrected = trial.recovery.corrected([SEEN])[0]
    np.testing.assert_allclose(SEEN.to_local(corrected.b), [0.0028, -0.0014, 0.0], atol=1e-9)
    trial.run(3.0)
    assert not trial.goals and trial.recovery.jams == 0
    np.testing.assert_array_equal(trial.recovery.corrected([SEEN])[0].b, corrected.b)


@pytest.mark.parametrize(
    ("tip_m", "enters"),
    [((0.0, 0.0, -0.05), False), ((0.05, 0.0, 0.05), False), ((0.004, 0.0, 0.08), True)],
    ids=["before the mouth", "beside the receptacle", "to go further in"],
)
def test_another_plug_says_nothing_of_it(tip_m: tuple[float, ...], enters: bool):
    recovery = Recovery(enters=enters)
    recovery.begin(SEEN.to_world(np.array([*tip_m, *ALIGNED])), SEEN)
    np.testing.assert_array_equal(recovery.corrected([SEEN])[0].b, SEEN.b)
