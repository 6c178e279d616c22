"""Approach task as all studies use it: taught with the paper's lambda, executed under disturbances.

Events in the scenarios of the approach task, to the receptacle and to the robot.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from farhand.common.model.task_frame import TaskFrame
from farhand.common.model.tphsmm import TPHSMM
from farhand.evaluation.metrics.sensor import EXACT, TRACKER, Sensor
from farhand.evaluation.paper.approach_task import (
    FAR_STARTS,
    LAMBDA_M,
    N_DEMONSTRATIONS,
    demonstrations,
    minimum_jerk,
    random_direction,
    random_frame,
    random_rotation,
    turned_tool,
)
from farhand.evaluation.paper.closed_loop import Disturbance
from farhand.local_site.learning.online_learner import LearnerSettings
from farhand.local_site.teaching.demonstration import Demonstration
from farhand.local_site.teaching.offline_learning import learn

Array = NDArray[np.float64]

JUMP_M, JUMP_RAD, JUMP_S = 0.15, np.radians(20.0), 3.5
SWAY_M, SWAY_RAD, SWAY_S = 0.05, 0.1, 6.0
PUSH_M, PUSH_S, PUSH_FOR_S = 0.12, 3.0, 0.3
HELD_S, HELD_FOR_S = 2.0, 3.5
# A late jump comes once the tool is this close, and leaves it this far before the plane of the mouth.
LATE_M, IN_FRONT_M = 0.05, 0.005


def moved(random: np.random.Generator, frame: TaskFrame) -> TaskFrame:
    """Return the receptacle after a jump in a random direction."""
    A = random_rotation(random, JUMP_RAD) @ frame.A
    return TaskFrame(A, frame.b + JUMP_M * random_direction(random))


class JumpingReceptacle(Disturbance):
    """Sudden displacement of the receptacle."""

    def __init__(self, frame: TaskFrame, random: np.random.Generator):
        super().__init__(frame)
        self._after = moved(random, frame)

    def frame(self, time_s: float, position: Array) -> TaskFrame:
        """See `Disturbance.frame`."""
        del position
        return self._frame if time_s < JUMP_S else self._after


class LateJumpingReceptacle(Disturbance):
    """Jump when the tool is already on its final approach; the tool stays in front of the mouth's plane."""

    def __init__(self, frame: TaskFrame, random: np.random.Generator):
        super().__init__(frame)
        self._random = random
        self._jumped = False

    def frame(self, time_s: float, position: Array) -> TaskFrame:
        """See `Disturbance.frame`."""
        del time_s
        if not self._jumped and self._frame.to_local(position)[2] < LATE_M:
            candidate = moved(self._random, self._frame)
            while candidate.to_local(position)[2] < IN_FRONT_M:
                candidate = moved(self._random, self._frame)
            self._frame, self._jumped = candidate, True
        return self._frame


class SwayingReceptacle(Disturbance):
    """Swinging of the receptacle to and fro, with rotation, as under a vessel."""

    def __init__(self, frame: TaskFrame, random: np.random.Generator):
        super().__init__(frame)
        self._along, self._about = random_direction(random), random_direction(random)
        self._phases = random.uniform(0.0, 2.0 * np.pi, 2)

    def frame(self, time_s: float, position: Array) -> TaskFrame:
        """See `Disturbance.frame`."""
        del position
        swing, turn = np.sin(2.0 * np.pi * time_s / SWAY_S + self._phases)
        A = Rotation.from_rotvec(SWAY_RAD * turn * self._about).as_matrix() @ self._frame.A
        return TaskFrame(A, self._frame.b + SWAY_M * swing * self._along)


class Push(Disturbance):
    """Quick, smooth displacement of the robot; its velocity afterwards is as before."""

    def __init__(self, frame: TaskFrame, random: np.random.Generator):
        super().__init__(frame)
        self._by = PUSH_M * random_direction(random)

    def robot(
        self, time_s: float, position: Array, velocity: Array, following: tuple[Array, Array]
    ) -> tuple[Array, Array]:
        """See `Disturbance.robot`."""
        del position, velocity
        tau = (np.array([time_s, time_s + 0.02]) - PUSH_S) / PUSH_FOR_S
        return following[0] + float(np.diff(minimum_jerk(tau))[0]) * self._by, following[1]


class Held(Disturbance):
    """Obstruction that holds the robot for a while."""

    def __init__(self, frame: TaskFrame, random: np.random.Generator):
        super().__init__(frame)
        del random

    def robot(
        self, time_s: float, position: Array, velocity: Array, following: tuple[Array, Array]
    ) -> tuple[Array, Array]:
        """See `Disturbance.robot`."""
        del velocity
        if HELD_S <= time_s < HELD_S + HELD_FOR_S:
            return position, np.zeros_like(position)
        return following


class Static(Disturbance):
    """Absence of events."""

    def __init__(self, frame: TaskFrame, random: np.random.Generator):
        super().__init__(frame)
        del random


SCENARIOS: dict[str, Callable[[TaskFrame, np.random.Generator], Disturbance]] = {
    "static": Static,
    "jump": JumpingReceptacle,
    "sway": SwayingReceptacle,
    "push": Push,
    "held": Held,
    "late jump": LateJumpingReceptacle,
}


def taught(
    seed: int,
    n: int = N_DEMONSTRATIONS,
    lambda_m: float = LAMBDA_M,
    oriented: bool = False,
    sensor: Sensor = TRACKER,
) -> tuple[list[Demonstration], TPHSMM]:
    """Return the synthetic hand's recorded demonstrations, and the model learned from them."""
    shown = demonstrations(np.random.default_rng([seed, 0]), n, oriented, sensor)
    return shown, learn(shown, LearnerSettings(lambda_m))


def hands(seed: int, n: int = N_DEMONSTRATIONS, oriented: bool = False) -> list[Demonstration]:
    """Return the same demonstrations without the sensor's errors."""
    return demonstrations(np.random.default_rng([seed, 0]), n, oriented, EXACT)


def scene(seed: int, scenario: str, oriented: bool = False) -> tuple[Disturbance, TaskFrame, Array]:
    """Return a trial's event, its receptacle, and the robot's first position or pose in the world."""
    random = np.random.default_rng([seed, 1])
    frame = random_frame(random)
    start = FAR_STARTS.sample(random)
    if oriented:
        start = np.concatenate([start, turned_tool(random)])
    return SCENARIOS[scenario](frame, random), frame, frame.to_world(start)


def stepping(model: TPHSMM) -> TPHSMM:
    """Return the same model without the ramp: the reference steps from mean to mean, as in the paper."""
    still = np.zeros_like(model.slopes)
    return replace(model, slopes=still, residual_covariances=model.covariances, ways=())
