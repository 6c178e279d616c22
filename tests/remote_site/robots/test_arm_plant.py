"""The arm behind the `Plant` protocol, with real contact: it tracks, inserts gently, and keeps its limits."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from farhand.common.arm.compliance import SeenReceptacle
from farhand.common.arm.kinematics import AT_ORIGIN, compose, difference, moved
from farhand.common.arm.servo import ServoSettings
from farhand.common.arm.setpoint import MotionLimits
from farhand.common.arm.simulation.disturbances import Surroundings
from farhand.common.arm.simulation.simulation import TICK_S, Simulation
from farhand.common.errors import InvalidInput
from farhand.remote_site.robots.arm_plant import ArmPlant
from tests.cells import JACO

STILL = Surroundings.still(JACO)
AWAY = STILL.with_receptacle(STILL.receptacle + np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0]))
BORE_M = JACO.receptacle.depth_m
DOWN_THE_AXIS = [(0.0, -0.12), (3.0, -0.12), (8.0, 0.083)]

Around = Callable[[float], Surroundings]
SHARED = Simulation(JACO)


def arm(around: Surroundings | Around = STILL, settings: ServoSettings | None = None) -> ArmPlant:
    return ArmPlant(SHARED, around if callable(around) else lambda _: around, settings)


def along_the_axis(depth_m: float) -> np.ndarray:
    return compose(SHARED.mouth, np.array([0.0, 0.0, depth_m, 1.0, 0.0, 0.0, 0.0]))


class Insertion:
    """A straight approach down the axis of a receptacle that is believed to be somewhere.

    Args:
        plant: The arm.
        error: Between the true receptacle and the believed one: a tangent. Shape (6,).
    """

    def __init__(self, plant: ArmPlant, error: tuple[float, ...] = (0.0,) * 6):
        self.plant = plant
        self._error = np.array(error)
        self.forces_n: list[float] = []
        self.depths_m: list[float] = []

    def run(self, until_s: float, way: list[tuple[float, float]] = DOWN_THE_AXIS) -> Insertion:
        plant, (times, depths) = self.plant, zip(*way, strict=True)
        mouth = plant.simulation.mouth
        while plant.time_s < until_s:
            before, mouth = mouth, plant.simulation.mouth
            seen = moved(mouth, self._error)
            plant.set_receptacle(SeenReceptacle(seen, difference(before, mouth) / TICK_S))
            depth = float(np.interp(plant.time_s, times, depths))
            plant.follow(compose(seen, np.array([0.0, 0.0, depth, 1.0, 0.0, 0.0, 0.0])), 0.15, TICK_S)
            force = plant.read().force_n
            assert force is not None
            self.forces_n.append(float(np.linalg.norm(force)))
            self.depths_m.append(plant.simulation.insertion.depth_m)
        return self

    def assert_seated(self, hold_n: float = 25.0, peak_n: float = 100.0) -> None:
        at = self.plant.simulation.insertion
        assert 0.075 <= at.depth_m <= 0.095
        assert at.lateral_m < 0.004
        assert max(self.depths_m) < 0.095
        assert max(self.forces_n) < peak_n
        assert 5.0 < np.mean(self.forces_n[-50:]) < hold_n
        assert self.plant.servo.governor.seated


@pytest.mark.parametrize("current_m_s", [0.0, 0.5])
@pytest.mark.parametrize(
    "way",
    [
        (0.15, 0.10, -0.08, 0.1, 0.1, 0.2),
        (0.10, -0.15, 0.05, -0.2, 0.1, -0.1),
        (0.0, 0.2, 0.0, 0.0, 0.0, 0.3),
    ],
)
def test_in_free_space_the_arm_is_where_its_setpoint_is(way: tuple[float, ...], current_m_s: float):
    plant = arm(replace(AWAY, current_m_s=np.array([0.0, current_m_s, 0.0])))
    errors = []
    for _ in range(500):
        setpoint = plant.read().setpoint
        assert setpoint is not None
        errors.append(difference(setpoint[0], plant.simulation.tip))
        plant.accelerate(np.array(way) * minimum_jerk_acceleration(plant.time_s, 4.0), TICK_S)
    position, turn = (
        np.linalg.norm(np.array(errors)[:, :3], axis=1),
        np.linalg.norm(np.array(errors)[:, 3:], axis=1),
    )
    assert np.sqrt(np.mean(position**2)) <= 0.6e-3
    assert np.degrees(np.sqrt(np.mean(turn**2))) <= 0.15


def minimum_jerk_acceleration(time_s: float, duration_s: float) -> float:
    t = time_s / duration_s
    return (60 * t - 180 * t**2 + 120 * t**3) / duration_s**2 if t < 1.0 else 0.0


@pytest.mark.parametrize(
    "error",
    [
        (0.0,) * 6,
        (0.005, 0.003, 0.003, 0.0, 0.0, 0.0),
        (-0.005, 0.0, 0.0, 0.05, 0.0, 0.0),
    ],
    ids=["known", "further and beside", "nearer and tilted"],
)
def test_a_straight_approach_ends_seated_with_little_force(error: tuple[float, ...]):
    Insertion(arm(), error).run(9.5).assert_seated()


@pytest.mark.parametrize("axis", [0, 2])
def test_seated_it_keeps_pressing_gently_while_the_receptacle_sways(axis: int):
    along = np.eye(6)[axis]

    def swaying(time_s: float) -> Surroundings:
        return STILL.with_receptacle(moved(STILL.receptacle, 0.05 * np.sin(0.4 * np.pi * time_s) * along))

    Insertion(arm(swaying)).run(12.0).assert_seated()


def test_what_is_inserted_comes_out_again():
    run = Insertion(arm()).run(9.0)
    run.assert_seated()
    out = run.run(14.0, [(0.0, 0.083), (9.0, 0.083), (13.0, -0.10)])
    assert out.plant.simulation.insertion.depth_m == pytest.approx(-0.10, abs=2e-3)
    assert not out.plant.servo.governor.seated
    assert out.forces_n[-1] < 2.0


def test_a_plug_that_is_to_come_out_is_not_pressed_in():
    plant = Insertion(arm()).run(9.0).plant
    seen = SeenReceptacle(
        moved(plant.simulation.mouth, np.array([0.008, 0.0, 0.0, 0.0, 0.0, 0.0])), np.zeros(6)
    )
    depths_m, forces_n = [plant.simulation.insertion.depth_m], []
    for depth in np.linspace(0.083, -0.05, 400):
        plant.set_receptacle(seen, presses=False)
        pose = compose(seen.pose, np.array([0.0, 0.0, depth, 1.0, 0.0, 0.0, 0.0]))
        plant.follow(pose, 0.15, TICK_S)
        depths_m.append(plant.simulation.insertion.depth_m)
        forces_n.append(np.linalg.norm(plant.servo.wrist.force))
    assert np.abs(np.diff(depths_m)).max() < 1e-3  # no jump when the pressing ends
    assert max(forces_n) < 30.0
    assert depths_m[-1] < -0.03


def test_a_plug_far_beside_the_mouth_stays_outside_and_presses_no_harder_than_it_may():
    run = Insertion(arm(), (0.0, 0.03, 0.0, 0.0, 0.0, 0.0)).run(9.0)
    assert run.plant.simulation.insertion.depth_m < 0.04
    assert not run.plant.servo.governor.seated
    assert max(run.forces_n) < 100.0


def test_braking_in_the_bore_holds_the_plug_relative_to_the_receptacle():
    def shifting(time_s: float) -> Surroundings:
        shift = 0.03 * np.clip((time_s - 7.5) / 2.0, 0.0, 1.0)
        return STILL.with_receptacle(STILL.receptacle + np.array([0.0, shift, 0.0, 0.0, 0.0, 0.0, 0.0]))

    plant = Insertion(arm(shifting)).run(7.0).plant
    at_first = plant.simulation.insertion.depth_m
    mouth = plant.simulation.mouth
    for _ in range(400):
        before, mouth = mouth, plant.simulation.mouth
        plant.set_receptacle(SeenReceptacle(mouth, difference(before, mouth) / TICK_S))
        plant.brake(TICK_S)
        force = plant.read().force_n
        assert force is not None and np.linalg.norm(force) < 25.0
    assert plant.simulation.insertion.depth_m == pytest.approx(at_first, abs=8e-3)
    assert plant.simulation.mouth[1] == pytest.approx(0.03, abs=1e-3)


def test_braking_in_free_water_stops_within_a_centimetre():
    plant = arm(AWAY)
    for _ in range(100):
        plant.follow(plant.read().point + np.array([0.0, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0]), 0.15, TICK_S)
    assert np.linalg.norm(plant.read().velocity_m_s) > 0.05
    start = plant.simulation.tip
    for _ in range(100):
        plant.brake(TICK_S)
    assert np.linalg.norm(plant.simulation.tip[:3] - start[:3]) < 0.025
    assert np.linalg.norm(plant.read().velocity_m_s) < 1e-3


@pytest.mark.parametrize("seed", range(2))
def test_limits_of_speed_joints_and_workspace_hold_whatever_is_asked(seed: int):
    random = np.random.default_rng(seed)
    limits = MotionLimits.of(JACO.robot)
    plant = arm(AWAY, ServoSettings(limits=limits))
    span = np.array([[0.820305, 5.462881], [0.331613, 5.951573]])
    for _ in range(4):
        acceleration = random.normal(size=6) * 1e3
        for _ in range(150):
            plant.accelerate(acceleration, TICK_S)
            state, physics = plant.read(), plant.simulation
            # The drives of the joints lag a little, and unlike each other.
            assert np.linalg.norm(state.velocity_m_s) < 1.1 * limits.speed_m_s
            assert (
                np.abs(plant.servo.solution.joint_velocities)
                <= np.array(JACO.robot.limits.velocity_rad_s) + 1e-6
            ).all()
            assert (physics.joints_rad[1:3] > span[:, 0]).all() and (
                physics.joints_rad[1:3] < span[:, 1]
            ).all()
            assert (physics.tip[:3] > np.array(limits.low_m) - 2e-3).all()
            assert (physics.tip[:3] < np.array(limits.high_m) + 2e-3).all()


def test_what_the_limits_take_away_is_reported():
    plant = arm(AWAY)
    plant.accelerate(np.zeros(6), TICK_S)
    assert plant.servo.solution.missing_m_s < 1e-3
    worst = 0.0
    for _ in range(200):  # away from the base, beyond its reach
        plant.accelerate(np.array([5.0, 0.0, 5.0, 0.0, 0.0, 0.0]), TICK_S)
        worst = max(worst, plant.servo.solution.missing_m_s)
    assert worst > 0.02


def test_the_links_stay_off_a_panel_that_is_in_the_way():
    """Asked to go sideways behind the panel, where the hand would have to pass through it."""
    plant = arm()
    plant.set_receptacle(SeenReceptacle(SHARED.mouth, np.zeros(6)))
    goal = compose(SHARED.mouth, np.array([0.15, 0.0, 0.20, *AT_ORIGIN[3:]]))
    for _ in range(600):
        plant.follow(goal, 0.15, TICK_S)
    force = plant.read().force_n
    assert force is not None
    assert np.linalg.norm(force) < 150.0
    assert plant.servo.kinematics.tip[0] < SHARED.mouth[0] + JACO.receptacle.panel_behind_m + 0.01


def test_the_same_seed_gives_the_same_bits():
    def run() -> bytes:
        plant = arm(lambda t: replace(STILL, current_m_s=np.array([0.2 * np.sin(t), 0.0, 0.0])))
        Insertion(plant, (0.0, 0.002, 0.0, 0.02, 0.0, 0.0)).run(8.5)
        state = plant.read()
        assert state.load is not None
        return state.point.tobytes() + state.velocity.tobytes() + state.load.tobytes()

    first = run()
    Insertion(arm(AWAY)).run(1.0)
    assert run() == first


def test_resets_need_no_more_memory():
    for _ in range(3):
        arm().brake(TICK_S)
    tracemalloc.start()
    before = tracemalloc.get_traced_memory()[0]
    for _ in range(20):
        plant = arm()
        for _ in range(20):
            plant.brake(TICK_S)
    grown = tracemalloc.get_traced_memory()[0] - before
    tracemalloc.stop()
    assert grown < 200_000


def test_another_control_period_is_refused():
    with pytest.raises(InvalidInput, match="dt_s"):
        arm().brake(0.02)
