from __future__ import annotations

import math

import numpy as np

from farhand.common.model.task_frame import TaskFrame
from farhand.common.task import Limits
from farhand.common.wire.reason_words import sentence
from farhand.remote_site.interface.plant import EffectorState, PointPlant
from farhand.remote_site.interface.sensing import Sensing
from farhand.remote_site.supervision.guards import (
    FORCE_FOR_S,
    SIGHT_MOVED_M,
    SIGHT_PATIENCE_S,
    SIGHT_TURNED_RAD,
    ForceGuard,
    SightGuard,
)

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
