from __future__ import annotations

import math

import numpy as np
import pytest
from msgspec import structs

from farhand.common.mode_table import Guard
from farhand.common.model.task_frame import TaskFrame
from farhand.common.task import Limits, PointTask
from farhand.common.wire.reason_words import sentence
from farhand.remote_site.interface.plant import EffectorState, PointPlant
from farhand.remote_site.interface.sensing import Sensing
from farhand.remote_site.supervision.guards import (
    BLIND_AND_ALONE_S,
    FORCE_FOR_S,
    LINK_LOST_S,
    SIGHT_MOVED_M,
    SIGHT_PATIENCE_S,
    SIGHT_TURNED_RAD,
    ForceGuard,
    LinkGuard,
    SightGuard,
)
from tests.remote_site.planar import TASK

LIMITS = Limits(force_n=250.0, force_peak_n=400.0)
TICK_S = 0.01


def feeling(*force_n: float) -> EffectorState:
    return EffectorState(np.zeros(2), np.zeros(2), np.array(force_n) if force_n else None)


class Target:
    """A target that the test moves and hides."""

    def __init__(self) -> None:
        self.seen, self.x, self.turn_rad = True, 0.0, 0.0

    def observe(self, now_s: float) -> list[TaskFrame] | None:
        c, s = math.cos(self.turn_rad), math.sin(self.turn_rad)
        return [TaskFrame(np.array([[c, -s], [s, c]]), np.array([self.x, 0.0]))] if self.seen else None

    def true_origin_m(self, now_s: float) -> None:
        return None


class Looking:
    """A sight guard on a target, 100 looks a second."""

    def __init__(self) -> None:
        self.target, self.now_s = Target(), 10.0
        plant = PointPlant(np.zeros(2), np.ones(2), 1.0, 1.0)
        self.sensing = Sensing(plant, self.target, 1, 1.0 / TICK_S, self.now_s)
        self.guard = SightGuard(self.sensing)
        self.look(0.5)

    def look(self, duration_s: float) -> str:
        """The first reason that the guard finds."""
        for _ in range(round(duration_s / TICK_S)):
            self.now_s += TICK_S
            self.sensing.update(self.now_s)
            if (reason := self.guard.reason()) is not None:
                return sentence(reason)
        return ""

    def blind_for(self, duration_s: float) -> str:
        self.target.seen = False
        reason = self.look(duration_s)
        self.target.seen = True
        return reason


def test_the_force_is_the_length_of_what_was_measured_if_anything_was():
    assert feeling(3.0, -4.0).contact_n == 5.0
    assert feeling().contact_n is None


def test_a_force_above_the_limit_is_tolerated_for_fifty_milliseconds():
    guard = ForceGuard(LIMITS)
    reasons = [guard.reason(feeling(0.0, 251.0), TICK_S) for _ in range(round(FORCE_FOR_S / TICK_S))]
    assert reasons[:-1] == [None] * (len(reasons) - 1)
    assert "251 N is above 250 N" in sentence(reasons[-1])


def test_a_force_that_was_below_the_limit_in_between_begins_anew():
    guard = ForceGuard(LIMITS)
    for _ in range(100):
        for force_n in (251.0, 251.0, 251.0, 251.0, 250.0):
            assert guard.reason(feeling(force_n, 0.0), TICK_S) is None


def test_a_force_above_the_peak_is_not_tolerated_at_all():
    why = ForceGuard(LIMITS).reason(feeling(-401.0, 0.0), TICK_S)
    assert why is not None and "401 N is above 400 N" in sentence(why) and why.measured == 401.0


def test_a_robot_that_feels_nothing_trips_on_nothing():
    assert ForceGuard(LIMITS).reason(feeling(), 10.0) is None


def test_an_execution_must_wait_after_three_tenths_of_a_second_without_sight():
    looking = Looking()
    looking.blind_for(0.29)
    assert not looking.guard.must_wait
    looking.blind_for(0.03)
    assert looking.guard.must_wait
    looking.look(TICK_S)
    assert not looking.guard.must_wait


def test_a_target_that_comes_back_where_it_was_expected_is_no_reason():
    looking = Looking()
    assert looking.blind_for(SIGHT_PATIENCE_S - 0.1) == ""
    looking.target.x += SIGHT_MOVED_M - 1e-3
    looking.target.turn_rad += SIGHT_TURNED_RAD - 1e-3
    assert looking.look(1.0) == ""


def test_a_target_that_stays_away_is_a_reason_after_five_seconds():
    looking = Looking()
    assert looking.blind_for(SIGHT_PATIENCE_S - TICK_S) == ""
    assert "not seen for 5 s" in looking.blind_for(3 * TICK_S)


def test_a_target_that_comes_back_elsewhere_is_a_reason():
    looking = Looking()
    looking.blind_for(1.0)
    looking.target.x += 0.03
    assert "30 mm off" in looking.look(TICK_S)


def test_a_target_that_comes_back_turned_is_a_reason():
    looking = Looking()
    looking.blind_for(1.0)
    looking.target.turn_rad = math.radians(10.0)
    assert "turned by 10 degrees" in looking.look(TICK_S)


def lost(
    guard: LinkGuard, task: PointTask, silent_s: float, executing: bool = True, blind: bool = False, dt_s: float = 0.1
):  # fmt: skip
    trip = guard.trip(task, silent_s, executing, blind, dt_s)
    return trip.guard if trip is not None else None


@pytest.mark.parametrize(
    ("policy", "expected"),
    [("continue", None), ("hold", Guard.LINK_LOST_HOLD), ("retract", Guard.LINK_LOST_RETRACT)],
)
def test_a_lost_link_is_answered_by_the_tasks_policy_once_for_each_loss(policy, expected):
    guard, task = LinkGuard(), structs.replace(TASK, lost_link=policy)
    for _ in range(2):
        assert lost(guard, task, LINK_LOST_S) is None
        assert lost(guard, task, LINK_LOST_S + 0.1) is expected
        assert lost(guard, task, LINK_LOST_S + 5.0) is None
        assert lost(guard, task, 0.0) is None


def test_what_is_not_executing_is_left_alone_by_a_lost_link():
    guard, task = LinkGuard(), structs.replace(TASK, lost_link="hold")
    assert lost(guard, task, 100.0, executing=False) is None


@pytest.mark.parametrize("allowed", [False, True])
def test_blind_and_alone_for_a_minute_retracts_if_the_task_allows(allowed: bool):
    guard, task = LinkGuard(), structs.replace(TASK, blind_retract=allowed)
    trips = [lost(guard, task, 10.0, executing=False, blind=True, dt_s=1.0) for _ in range(70)]
    assert trips[: int(BLIND_AND_ALONE_S)] == [None] * int(BLIND_AND_ALONE_S)
    assert (Guard.LINK_LOST_RETRACT in trips) == allowed


@pytest.mark.parametrize(("silent_s", "blind"), [(0.0, True), (10.0, False)])
def test_the_minute_begins_anew_when_the_link_or_the_sight_comes_back(silent_s: float, blind: bool):
    guard, task = LinkGuard(), structs.replace(TASK, blind_retract=True)
    for _ in range(3):
        assert lost(guard, task, 10.0, executing=False, blind=True, dt_s=50.0) is None
        assert lost(guard, task, silent_s, executing=False, blind=blind, dt_s=1.0) is None
