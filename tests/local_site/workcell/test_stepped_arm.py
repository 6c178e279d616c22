"""The operator's arm as it follows a hand, its time passing with the hand's."""

from __future__ import annotations

import numpy as np
import pytest

from farhand.common.errors import InvalidDemonstration
from farhand.deploy.places import sample_files
from farhand.local_site.workcell.arm_drivers import SteppedArm
from tests.cells import JACO
from tests.local_site.robot_end import HOT_STAB

Array = np.ndarray


class Held:
    """An arm, and all that it moved through."""

    def __init__(self, seed: int = 0):
        self.arm = SteppedArm(HOT_STAB, JACO, sample_files, seed)
        self.points: list[Array] = []
        self.times_s: list[float] = []
        self.joints: list[Array] = []
        self.arm.start(lambda job: job(), self.moved)

    def moved(self, points: Array, times_s: Array) -> None:
        self.points += list(points)
        self.times_s += times_s.tolist()

    def lead(self, pose: Array, duration_s: float, released: bool = True) -> None:
        """Hold the hand at a pose, with an event every 50 ms."""
        for time_s in np.arange(0.0, duration_s + 1e-9, 0.05):
            self.arm.hand(tuple(pose.tolist()), float(time_s), released=False)
            self.joints.append(self.arm.view.joints_rad)
        if released:
            self.arm.hand(tuple(pose.tolist()), duration_s, released=True)


def elsewhere(pose: Array, *offset_m: float) -> Array:
    out = pose.copy()
    out[:3] += offset_m
    return out


def test_the_arm_follows_the_hand_and_what_it_reached_is_told_at_a_hundred_hertz():
    it = Held()
    start = it.arm.view.tip
    goal = elsewhere(start, -0.05, 0.08, 0.05)
    it.lead(goal, 2.0)
    np.testing.assert_allclose(np.diff(it.times_s), 0.01)
    assert len(it.points) == 200
    reached = np.stack(it.points)
    assert np.linalg.norm(reached[0, :3] - start[:3]) < 1e-3, (
        "it begins where the arm is, not where the hand is"
    )
    assert np.linalg.norm(reached[-1, :3] - goal[:3]) < 1e-3
    assert np.linalg.norm(np.diff(reached[:, :3], axis=0), axis=1).max() < 0.0026
    np.testing.assert_allclose(reached[-1], it.arm.view.tip, atol=1e-12)


def test_the_same_hand_gives_the_same_bits():
    one, other = Held(seed=4), Held(seed=4)
    for it in (one, other):
        it.lead(elsewhere(it.arm.view.tip, 0.0, 0.1, 0.0), 1.0)
    np.testing.assert_array_equal(one.points, other.points)


@pytest.mark.parametrize("offset_m", [(0.0, 1.5, 0.0), (1e9, 0.0, 0.0)])
def test_what_cannot_be_reached_is_said_and_costs_nothing(offset_m: tuple[float, float, float]):
    it = Held()
    home = it.arm.view.tip
    saturated = []
    far = elsewhere(home, *offset_m)
    for time_s in np.arange(0.0, 6.0, 0.05):
        it.arm.hand(tuple(far.tolist()), float(time_s), released=False)
        it.joints.append(it.arm.view.joints_rad)
        saturated.append(it.arm.view.saturated)
    assert any(saturated)
    speed = np.abs(np.diff(it.joints, axis=0)).max(axis=0) / 0.05
    assert (speed <= 1.05 * np.array(JACO.robot.limits.velocity_rad_s)).all()
    it.arm.hand(tuple(far.tolist()), 6.0, released=True)
    it.lead(home, 6.0)
    assert np.linalg.norm(it.arm.view.tip[:3] - home[:3]) < 2e-3 and not it.arm.view.saturated


def test_a_hand_that_lets_go_leaves_the_arm_where_it_is():
    it = Held()
    it.lead(elsewhere(it.arm.view.tip, 0.0, 0.15, 0.0), 0.6)
    assert not it.arm.view.held
    there, told = it.arm.view.tip, len(it.points)
    # The hand comes back later, far away: the arm has stood meanwhile, and nothing of it was told.
    it.arm.hand(tuple(there.tolist()), 50.0, released=False)
    assert len(it.points) == told and it.arm.view.held
    assert np.linalg.norm(it.arm.view.tip[:3] - there[:3]) < 0.02


def test_a_renewal_puts_arm_and_receptacle_elsewhere_by_its_seed():
    it = Held()
    first = it.arm.view
    it.lead(elsewhere(first.tip, 0.0, 0.1, 0.0), 0.5, released=False)
    it.arm.reset(7)
    seventh = it.arm.view
    assert seventh.seed == 7 and not seventh.held and not np.array_equal(seventh.receptacle, first.receptacle)
    np.testing.assert_array_equal(it.arm.frames[0].b, seventh.receptacle[:3])
    it.arm.reset(None)
    assert it.arm.view.seed == 8
    it.arm.reset(7)
    np.testing.assert_array_equal(it.arm.view.tip, seventh.tip)


@pytest.mark.parametrize("point", [(0.1, 0.2), (np.nan,) * 7, (0.5, 0.0, 0.4, 2.0, 0.0, 0.0, 0.0)])
def test_a_hand_that_is_nowhere_moves_nothing(point: tuple[float, ...]):
    it = Held()
    with pytest.raises(InvalidDemonstration):
        it.arm.hand(point, 0.0, released=False)
    assert not it.arm.view.held


def test_the_samples_are_those_of_the_files():
    samples = Held().arm.samples()
    assert len(samples) == 5 and all(sample.space.oriented for sample in samples)
