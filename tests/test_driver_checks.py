"""`farhand.testing`: sound drivers pass, and each fault of another one is named."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import cast

import numpy as np
import pytest

from farhand.common.arm.simulation.disturbances import Surroundings
from farhand.common.arm.simulation.simulation import TICK_S, Simulation
from farhand.common.errors import InvalidInput
from farhand.common.model.task_frame import TaskFrame
from farhand.remote_site.interface.plant import EffectorState, Plant, PointPlant
from farhand.remote_site.perception.simulated_sight import OscillatingTarget, SimulatedPerception
from farhand.remote_site.robots.arm_plant import ArmPlant
from farhand.testing import check_perception, check_plant
from tests.cells import JACO
from tests.remote_site.planar import TASK

SPEED_M_S, ACCELERATION_M_S2 = 0.6, 4.0


def at_once(_duration_s: float) -> None:
    """The pace of a simulation."""


class Sound(PointPlant):
    """The paper's point, from which each plant below differs in one way."""

    def __init__(self) -> None:
        super().__init__(np.array([0.2, 0.5]), np.ones(2), SPEED_M_S, ACCELERATION_M_S2)
        self.parts: list[str] = []

    def start(self) -> None:
        self.parts.append("start")

    def halt(self) -> None:
        self.parts.append("halt")

    def close(self) -> None:
        self.parts.append("close")


def check(plant: Plant) -> None:
    check_plant(
        plant, max_speed_m_s=SPEED_M_S, max_acceleration_m_s2=ACCELERATION_M_S2, room_m=0.3, pace=at_once
    )


def test_the_shipped_point_is_sound_and_what_was_started_is_halted_and_closed():
    plant = Sound()
    check(plant)
    assert plant.parts == ["start", "halt", "halt", "halt", "close"]


def test_the_shipped_arm_is_sound():
    around = Surroundings.still(JACO)
    away = around.with_receptacle(around.receptacle + np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0]))
    plant = ArmPlant(Simulation(JACO), lambda _: away)
    check_plant(plant, max_speed_m_s=0.15, max_acceleration_m_s2=1.0, dt_s=TICK_S, room_m=0.08, pace=at_once)


def test_the_pace_is_that_of_the_control_loop():
    waits: list[float] = []
    check_plant(Sound(), max_speed_m_s=SPEED_M_S, max_acceleration_m_s2=ACCELERATION_M_S2, pace=waits.append)
    assert len(waits) > 50 and set(waits) == {0.02}


class Silent(Sound):
    def accelerate(self, acceleration: np.ndarray, dt_s: float) -> None:
        pass


class Reversed(Sound):
    def accelerate(self, acceleration: np.ndarray, dt_s: float) -> None:
        super().accelerate(-acceleration, dt_s)


class Deaf(Sound):
    def follow(self, point: np.ndarray, max_speed_m_s: float, dt_s: float) -> None:
        pass


class Hasty(Sound):
    def follow(self, point: np.ndarray, max_speed_m_s: float, dt_s: float) -> None:
        super().follow(point, 2.0 * max_speed_m_s, dt_s)


class Rolling(Sound):
    def brake(self, dt_s: float) -> None:
        self._move_with(self._velocity, dt_s)


class Unlimited(Sound):
    def __init__(self) -> None:
        super().__init__()
        self._max_speed = self._max_acceleration = 50.0


class Shared(Sound):
    def __init__(self) -> None:
        super().__init__()
        self._shared = np.zeros(2)

    def read(self) -> EffectorState:
        self._shared[:] = self._position
        return EffectorState(self._shared, self._velocity.copy())


class NotFinite(Sound):
    def read(self) -> EffectorState:
        return replace(super().read(), velocity=np.full(2, np.nan))


class Shapeless(Sound):
    def read(self) -> EffectorState:
        return replace(super().read(), load=np.zeros(3))


class Lists(Sound):
    def read(self) -> EffectorState:
        return replace(super().read(), point=[0.1, 0.2])


class Tuples(Sound):
    def read(self) -> EffectorState:
        return cast(EffectorState, (np.zeros(2), np.zeros(2)))


class Raising(Sound):
    def read(self) -> EffectorState:
        raise OSError("CAN bus is off")


class FaultOfNone(Sound):
    fault = None


class BrokenHalt(Sound):
    def halt(self) -> None:
        raise OSError("no such line")


class Waiting(Sound):
    def read(self) -> EffectorState:
        time.sleep(0.012)
        return super().read()


class NoBrake:
    def read(self) -> EffectorState:
        return EffectorState(np.zeros(2), np.zeros(2))

    accelerate = follow = read


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        (Silent, "accelerate: changed the speed by 0.000 m/s where -"),
        (Reversed, "accelerate: changed the speed by "),
        (Deaf, "follow: 0.150 m from a goal 0.15 m away; it moved 0.000 m"),
        (Hasty, "m/s, told to keep below 0.30"),
        (Rolling, "brake: still "),
        (Unlimited, "above the limit of 0.6"),
        (Unlimited, "m/s^2, above the limit of 4"),
        (Shared, "read: a reading changes when the robot moves on: return copies"),
        (NotFinite, "read: finite numbers only"),
        (Shapeless, "read: load: an array of shape (2,), got shape (3,)"),
        (Lists, "read: point: an array of shape (2,), got list"),
        (Tuples, "read: an EffectorState, got tuple"),
        (Raising, "OSError: CAN bus is off"),
        (FaultOfNone, "fault: an empty text while it has none, got None"),
        (BrokenHalt, "OSError: no such line"),
        (Waiting, "wait for a bus in a thread of your own"),
        (NoBrake, "it has no brake"),
    ],
)
def test_each_fault_of_a_plant_is_named(kind: Callable[[], Plant], words: str):
    with pytest.raises(AssertionError) as told:
        check(kind())
    assert words in str(told.value)
    assert all(line.startswith("plant: ") for line in str(told.value).splitlines())


def test_a_room_that_is_too_small_for_the_limits_is_refused_before_anything_moves():
    plant = Sound()
    with pytest.raises(InvalidInput, match=r"room_m: 0\.225 m or more"):
        check_plant(plant, max_speed_m_s=SPEED_M_S, max_acceleration_m_s2=ACCELERATION_M_S2, room_m=0.1)
    assert plant.parts == []


class Sight:
    def __init__(self, seen: object, truth_m: object = None):
        self._seen, self._truth_m = seen, truth_m

    def observe(self, now_s: float):
        return self._seen

    def true_origin_m(self, now_s: float):
        return self._truth_m


def test_the_shipped_perception_is_sound():
    check_perception(
        SimulatedPerception.of_oscillating(OscillatingTarget(TASK.target), 0.001, 0), pace=at_once
    )


@pytest.mark.parametrize(
    ("sight", "words"),
    [
        (Sight(None), "observe: it saw nothing"),
        (Sight([]), "1 task frames, as the task's frame_names has, got 0"),
        (Sight([TaskFrame.identity(3)]), "frames of 2 dimensions, got 3"),
        (Sight([np.zeros(2)]), "a list of TaskFrame"),
        (Sight([TaskFrame.identity(2)], np.zeros(3)), "true_origin_m: 2 finite numbers or None"),
        (object(), "it has no observe"),
    ],
)
def test_each_fault_of_a_perception_is_named(sight, words: str):
    with pytest.raises(AssertionError) as told:
        check_perception(sight, duration_s=0.1, pace=at_once)
    assert words in str(told.value)
