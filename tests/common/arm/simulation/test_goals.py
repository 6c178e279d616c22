from __future__ import annotations

from dataclasses import dataclass
from typing import cast

import numpy as np
import pytest

from farhand.common.arm.simulation.simulation import TICK_S, Simulation
from farhand.common.arm.simulation.starts_and_goals import MAX_DRAGGED_M, STANDOFF_M, Seated, Withdrawn


@dataclass
class Truth:
    """What a goal asks of a simulation."""

    deflection_m: float = 0.0
    time_s: float = 0.0


def at(x: float, y: float, z: float) -> np.ndarray:
    return np.array([x, y, z, 1.0, 0.0, 0.0, 0.0])


@pytest.mark.parametrize(
    ("tip_m", "seated"),
    [
        ((0.0, 0.0, 0.084), True),
        ((0.0, 0.0, 0.074), False),
        ((0.0, 0.0, 0.096), False),
        ((0.003, 0.003, 0.084), False),
    ],
)
def test_seated_is_deep_enough_not_through_and_on_the_axis(tip_m: tuple[float, float, float], seated: bool):
    assert Seated().reached(at(*tip_m), 20.0, cast(Simulation, Truth())) is seated


def watched(goal: Withdrawn, path: np.ndarray, force_n: float = 0.0, truth: Truth | None = None) -> bool:
    truth, reached = truth or Truth(), False
    for z in path:
        truth.time_s += TICK_S
        reached = goal.reached(at(0.0, 0.0, z), force_n, cast(Simulation, truth))
    return reached


def test_withdrawn_is_near_the_stand_off_at_rest_and_free():
    there = np.full(60, -STANDOFF_M)
    assert watched(Withdrawn(), there)
    assert watched(Withdrawn(), there + 0.014)
    assert not watched(Withdrawn(), there + 0.016)
    assert not watched(Withdrawn(), there, force_n=6.0)
    assert not watched(Withdrawn(), there + 0.02 * TICK_S * np.arange(-60, 0))  # still on its way
    assert watched(Withdrawn(0.030, 0.08), there + 0.02 * TICK_S * np.arange(-60, 0) + 0.02)


def test_it_remembers_when_the_plug_came_out_and_how_far_the_receptacle_was_dragged():
    goal, truth = Withdrawn(), Truth(deflection_m=0.003)
    watched(goal, np.full(10, 0.05), truth=truth)
    truth.deflection_m = 0.0
    watched(goal, np.full(10, -0.01), truth=truth)
    assert goal.dragged_m == 0.003
    assert goal.out_s == pytest.approx(11 * TICK_S)


def test_a_plug_that_dragged_its_receptacle_along_has_failed_for_good():
    goal, truth = Withdrawn(), Truth(deflection_m=MAX_DRAGGED_M + 1e-6)
    watched(goal, np.full(10, 0.05), truth=truth)
    truth.deflection_m = 0.0
    assert not watched(goal, np.full(60, -STANDOFF_M), truth=truth)
