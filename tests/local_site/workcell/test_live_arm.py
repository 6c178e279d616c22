"""The operator's arm in real time; how it moves: `test_stepped_arm.py`."""

from __future__ import annotations

import queue
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from farhand.local_site.workcell.arm_drivers import LiveArm
from tests.cells import JACO
from tests.local_site.robot_end import HOT_STAB

PATIENCE_S = 60.0


class Desk:
    """An arm, and the thread of its console, which is the test's."""

    def __init__(self) -> None:
        self.jobs: queue.Queue[Callable[[], None]] = queue.Queue()
        self.points: list[np.ndarray] = []
        self.times_s: list[float] = []
        self.arm = LiveArm(HOT_STAB, JACO, seed=1)
        self.arm.start(self.jobs.put, self.moved)

    def moved(self, points: np.ndarray, times_s: np.ndarray) -> None:
        self.points += list(points)
        self.times_s += times_s.tolist()

    def until(self, holds: Callable[[], bool]) -> None:
        while not holds():
            self.jobs.get(timeout=PATIENCE_S)()


@pytest.fixture
def desk() -> Iterator[Desk]:
    desk = Desk()
    yield desk
    desk.arm.close()


def test_it_goes_to_the_hand_by_itself_and_falls_asleep_when_let_go(desk: Desk):
    goal = desk.arm.view.tip + np.array([0.0, 0.03, 0.02, 0.0, 0.0, 0.0, 0.0])
    desk.arm.hand(tuple(goal.tolist()), 0.0, released=False)
    desk.until(lambda: float(np.linalg.norm(desk.arm.view.tip[:3] - goal[:3])) < 1e-3)
    assert desk.arm.view.held
    np.testing.assert_allclose(np.diff(desk.times_s), 0.01)
    desk.arm.hand(tuple(goal.tolist()), 0.0, released=True)
    desk.until(lambda: desk.arm.asleep)
    assert not desk.arm.view.held
    assert desk.jobs.empty(), "an arm that says it is asleep has told everything"
    told = len(desk.points)
    desk.arm.hand(tuple(goal.tolist()), 0.0, released=False)
    assert not desk.arm.asleep
    desk.until(lambda: len(desk.points) > told)  # and it wakes again


def test_a_hand_that_comes_while_it_falls_asleep_keeps_it_awake(desk: Desk):
    """Its last report, which says that it sleeps, is taken after the hand was there."""
    goal = tuple(desk.arm.view.tip.tolist())
    desk.arm.hand(goal, 0.0, released=False)
    desk.arm.hand(goal, 0.0, released=True)
    waiting: list[Callable[[], None]] = []
    while not desk.arm._arm.asleep:  # the reports wait, as they do on a busy machine
        waiting.append(desk.jobs.get(timeout=PATIENCE_S))
    desk.arm.hand(goal, 0.0, released=False)
    for report in waiting:
        report()
    assert not desk.arm.asleep
    desk.until(lambda: desk.arm.view.held)
    assert not desk.arm.asleep


def test_a_renewal_is_done_when_it_returns_and_nothing_of_before_is_told(desk: Desk):
    goal = desk.arm.view.tip + np.array([0.0, 0.2, 0.0, 0.0, 0.0, 0.0, 0.0])
    desk.arm.hand(tuple(goal.tolist()), 0.0, released=False)
    desk.until(lambda: len(desk.points) > 0)
    desk.arm.reset(5)
    assert desk.arm.view.seed == 5
    told, there = len(desk.points), desk.arm.view.tip
    desk.until(lambda: desk.arm.asleep)
    assert len(desk.points) == told
    np.testing.assert_allclose(desk.arm.view.tip, there, atol=1e-3)
