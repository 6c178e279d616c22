"""What acts first when more than one guard could, and when none does."""

from __future__ import annotations

import numpy as np
import pytest

from farhand.common.mode_table import Action, ControlMode, Guard, Phase
from farhand.remote_site.interface.embodiment import Guidance
from farhand.remote_site.supervision.guards import Guards
from tests.remote_site.bench import BEGINNINGS, DT_S, Bench, FeelingPlant

DEADLINE_S = 0.5
MOVING = (ControlMode.DIRECT, ControlMode.AUTONOMOUS)


class Watched:
    """A bench in some mode, and a watch of its own on the same robot."""

    def __init__(self, mode: ControlMode):
        self.plant = FeelingPlant()
        self.bench = Bench(plant=self.plant)
        BEGINNINGS[mode](self.bench)
        robot = self.bench.robot
        self.watch = Guards(robot.sensing, robot.contact, robot.motion, DEADLINE_S)

    def trip(self, late_s: float = 0.0) -> Guard | None:
        bench = self.bench
        bench.robot.sensing.update(bench.clock.now_s())
        trip = self.watch.trip(bench.mode, Guidance(), bench.clock.now_s(), DT_S, late_s)
        return trip.guard if trip is not None else None


@pytest.mark.parametrize("mode", ControlMode)
def test_a_robot_that_is_well_trips_on_nothing(mode: ControlMode):
    assert Watched(mode).trip() is None


@pytest.mark.parametrize("mode", ControlMode)
def test_a_late_period_and_a_high_force_matter_while_something_moves(mode: ControlMode):
    watched = Watched(mode)
    assert watched.trip(late_s=DEADLINE_S) is None
    assert (watched.trip(late_s=DEADLINE_S + 0.01) is Guard.FAULT) == (mode in MOVING)
    watched.plant.force_n = np.array([500.0, 0.0])
    assert (watched.trip() is Guard.FORCE) == (mode in MOVING)


def test_a_late_period_weighs_more_than_force_and_force_more_than_a_lost_operator():
    watched = Watched(ControlMode.DIRECT)
    watched.bench.time.advance(20.0)
    assert watched.trip() is Guard.COUPLING_ENDED
    watched.plant.force_n = np.array([500.0, 0.0])
    assert watched.trip() is Guard.FORCE
    assert watched.trip(late_s=1.0) is Guard.FAULT


def test_a_robot_that_backs_off_is_not_told_so_again():
    watched = Watched(ControlMode.AUTONOMOUS)
    watched.plant.force_n = np.array([500.0, 0.0])
    watched.bench.run(2 * DT_S)
    assert watched.bench.robot.phase is Phase.BACKING_OFF
    assert watched.trip() is None


def test_a_manoeuvre_needs_no_sight_of_the_target():
    watched = Watched(ControlMode.HOLD)
    assert watched.bench.command(Action.GO_TO_READY).accepted
    watched.bench.sight.seen = False
    watched.bench.time.advance(10.0)
    assert watched.trip() is None


def test_a_changed_delay_that_nobody_drives_by_is_forgotten():
    watched = Watched(ControlMode.HOLD)
    watched.bench.robot.contact.delay_changed = True
    assert watched.trip() is None
    assert not watched.bench.robot.contact.delay_changed
