"""Simulated arm: one control period of 10 ms, its parts, and the inverse kinematics beside mink's solver."""

from __future__ import annotations

from collections.abc import Callable

import mink
import numpy as np

from benchmarks.timing import BenchmarkRow, best_times_us
from farhand.common.arm.compliance import SeenReceptacle
from farhand.common.arm.kinematics import Kinematics, compose
from farhand.common.arm.simulation.disturbances import Surroundings
from farhand.common.arm.simulation.simulation import TICK_S, Simulation
from farhand.common.arm.velocity_ik import VelocityIk
from farhand.remote_site.robots.arm_plant import ArmPlant
from tests.cells import JACO

_TWIST = np.array([0.05, 0.02, -0.03, 0.1, 0.0, 0.2])


def rows() -> list[BenchmarkRow]:
    """Time physics, servo and both together, in free water and seated."""
    free, seated = _plant(until_s=0.5), _plant(until_s=9.5)
    kinematics = Kinematics(JACO)
    ik = VelocityIk(kinematics)
    still = Surroundings.still(JACO)
    bare, at_rest = Simulation(JACO), np.zeros(6)
    us = best_times_us(
        {
            "free": _ticks(free),
            "seated": _ticks(seated),
            "physics": lambda: bare.step(at_rest, still),
            "ours": lambda: ik.solve(_TWIST),
            "peer": lambda: _as_mink_does(ik, kinematics),
        }
    )
    return [
        BenchmarkRow("arm: a tick in free water, physics and servo", us["free"], target="<= 900 us"),
        BenchmarkRow("arm: a tick while seated, physics and servo", us["seated"], target="<= 900 us"),
        BenchmarkRow("arm: its physics alone", us["physics"]),
        BenchmarkRow("arm: inverse kinematics with all limits", us["ours"], "mink.solve_ik", us["peer"]),
    ]


def _plant(until_s: float) -> ArmPlant:
    """Return an arm that has moved down the axis for a time."""
    plant = ArmPlant(Simulation(JACO), lambda _: Surroundings.still(JACO))
    plant.set_receptacle(SeenReceptacle(plant.simulation.mouth, np.zeros(6)))
    while plant.time_s < until_s:
        depth_m = float(np.interp(plant.time_s, [3.0, 8.0], [-0.12, 0.083]))
        goal = compose(plant.simulation.mouth, np.array([0.0, 0.0, depth_m, 1.0, 0.0, 0.0, 0.0]))
        plant.follow(goal, 0.15, TICK_S)
    return plant


def _ticks(plant: ArmPlant) -> Callable[[], None]:
    goal = compose(
        plant.simulation.mouth, np.array([0.0, 0.0, plant.simulation.insertion.depth_m, 1, 0, 0, 0])
    )

    def tick() -> None:
        plant.follow(goal, 0.15, TICK_S)
        plant.read()

    return tick


def _as_mink_does(ik: VelocityIk, kinematics: Kinematics) -> np.ndarray:
    return mink.solve_ik(kinematics.configuration, [ik.task], 0.1, "daqp", damping=1e-4, limits=ik.limits)
