"""The physics: deterministic, honest about its failures, and with the forces that it should have."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from farhand.common.arm.cell import Cell, Receptacle
from farhand.common.arm.simulation.disturbances import Surroundings
from farhand.common.arm.simulation.simulation import TICK_S, PhysicsFailed, Simulation
from farhand.common.errors import InvalidInput
from tests.cells import JACO

STILL = Surroundings.still(JACO)
AT_REST = np.zeros(6)


@pytest.fixture(scope="module")
def simulation() -> Simulation:
    return Simulation(JACO)


def begin(simulation: Simulation, surroundings: Surroundings = STILL) -> Simulation:
    simulation.reset(np.array(JACO.robot.home_rad), surroundings)
    return simulation


def moved(by_m: tuple[float, float, float], surroundings: Surroundings = STILL) -> Surroundings:
    pose = surroundings.receptacle.copy()
    pose[:3] += by_m
    return surroundings.with_receptacle(pose)


def in_the_bore(depth_m: float) -> Surroundings:
    """The receptacle moved over the plug of the arm at home."""
    simulation = Simulation(JACO)
    tip = simulation.tip
    pose = tip.copy()
    pose[:3] -= depth_m * Rotation.from_quat(tip[3:], scalar_first=True).as_matrix()[:, 2]
    return STILL.with_receptacle(pose)


def test_at_home_the_plug_points_at_the_receptacle(simulation: Simulation):
    at = begin(simulation).insertion
    assert at.depth_m == pytest.approx(-0.16, abs=1e-3)
    assert at.tilt_rad < 1e-3


def test_the_receptacle_is_where_it_is_put_and_follows_where_it_is_led(simulation: Simulation):
    turn = Rotation.from_quat(STILL.receptacle[3:], scalar_first=True) * Rotation.from_rotvec(
        [0.2, -0.1, 0.3]
    )
    pose = np.concatenate([[0.80, 0.05, 0.40], turn.as_quat(scalar_first=True)])
    begin(simulation, STILL.with_receptacle(pose))
    assert np.abs(simulation.mouth[:3] - pose[:3]).max() < 1e-9
    assert abs(simulation.mouth[3:] @ pose[3:]) == pytest.approx(1.0)
    begin(simulation)
    for tick in range(1, 300):
        target = moved((0.0, 0.05 * np.sin(0.4 * np.pi * tick * TICK_S), 0.0))
        simulation.step(AT_REST, target)
        assert np.linalg.norm(simulation.mouth[:3] - target.receptacle[:3]) < 1e-3


def test_a_swaying_vehicle_sees_the_receptacle_move_the_other_way(simulation: Simulation):
    begin(simulation)
    vehicle = np.array([0.0, 0.02, 0.0, 1.0, 0.0, 0.0, 0.0])
    for _ in range(100):
        simulation.step(AT_REST, replace(STILL, vehicle=vehicle))
    assert simulation.mouth[1] == pytest.approx(STILL.receptacle[1] - 0.02, abs=1e-4)


def test_the_wrist_carries_the_weight_of_hand_and_plug(simulation: Simulation):
    begin(simulation)
    for _ in range(50):
        simulation.step(AT_REST, STILL)
    force = simulation.wrench[:3]
    mass_kg = JACO.plug.mass_kg + 0.54719 + 3 * (0.0255204 + 0.0132655)
    assert force[1] == pytest.approx(9.81 * mass_kg, rel=0.02)  # y points down
    assert np.abs(force[[0, 2]]).max() < 0.3


def test_a_push_on_the_hand_is_felt_in_its_direction(simulation: Simulation):
    begin(simulation)
    before = simulation.wrench
    for _ in range(20):
        simulation.step(AT_REST, replace(STILL, push_n=np.array([0.0, 0.0, 20.0])))  # upwards
    assert (simulation.wrench - before)[1] == pytest.approx(-20.0, abs=0.5)


def test_a_receptacle_that_runs_over_the_plug_pushes_it_back(simulation: Simulation):
    """Its spring is strained by what the plug resists with."""
    begin(simulation, in_the_bore(0.080))
    before = simulation.wrench
    for tick in range(100):
        nearer = min(tick / 50, 1.0) * 0.010
        simulation.step(AT_REST, moved((-nearer, 0.0, 0.0), in_the_bore(0.080)))
    felt = (simulation.wrench - before)[:3]
    strain = simulation.mouth[0] - (in_the_bore(0.080).receptacle[0] - 0.010)
    assert felt[2] == pytest.approx(-JACO.receptacle.stiffness_n_m * strain, rel=0.1)
    assert felt[2] < -10.0
    assert 0.080 < simulation.insertion.depth_m < 0.088


def test_no_force_drives_the_plug_through_the_bottom(simulation: Simulation):
    """A receptacle that comes with 0.3 m/s, ten times the arm's strength behind it."""
    stiff = Cell(robot=JACO.robot, receptacle=Receptacle(stiffness_n_m=250e3))
    rammed = Simulation(stiff)
    rammed.reset(np.array(stiff.robot.home_rad), in_the_bore(0.060))
    depth = []
    for tick in range(100):
        rammed.step(AT_REST, moved((-min(0.3 * tick * TICK_S, 0.08), 0.0, 0.0), in_the_bore(0.060)))
        depth.append(rammed.insertion.depth_m)
    assert max(depth) < 0.095


def test_current_drags_the_arm_and_still_water_does_not(simulation: Simulation):
    def drift(current_m_s: float) -> float:
        begin(simulation)
        for _ in range(100):
            simulation.step(AT_REST, replace(STILL, current_m_s=np.array([0.0, current_m_s, 0.0])))
        return float(simulation.tip[1])

    assert drift(0.8) - drift(0.0) > 2e-3
    assert drift(0.8) == pytest.approx(-drift(-0.8), abs=1e-3)


def test_the_same_calls_give_the_same_bits(simulation: Simulation):
    def run(physics: Simulation) -> bytes:
        begin(physics, in_the_bore(0.07))
        for tick in range(100):
            physics.step(np.full(6, 0.05), moved((0.0, 0.0, 1e-4 * tick), in_the_bore(0.07)))
        return b"".join(a.tobytes() for a in (physics.joints_rad, physics.wrench, physics.mouth))

    assert run(simulation) == run(simulation) == run(Simulation(JACO))


def test_a_warning_of_the_physics_is_an_error(simulation: Simulation):
    begin(simulation)
    with pytest.raises(PhysicsFailed, match="mjWARN_BADCTRL"):
        simulation.step(np.full(6, np.nan), STILL)
    begin(simulation)
    simulation.step(AT_REST, STILL)


@pytest.mark.parametrize("joints", [np.zeros(5), np.full(6, np.nan), np.zeros(6)])
def test_impossible_joint_angles_are_refused(simulation: Simulation, joints: np.ndarray):
    with pytest.raises(InvalidInput, match="joints_rad"):
        simulation.reset(joints, STILL)


def test_a_pose_without_orientation_is_refused():
    with pytest.raises(InvalidInput, match="receptacle"):
        STILL.with_receptacle(np.zeros(7))
