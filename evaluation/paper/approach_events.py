"""Events in the scenarios of the approach task, to the receptacle and to the robot."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from farhand.common.model.task_frame import TaskFrame
from farhand.evaluation.paper.approach_task import minimum_jerk, random_direction, random_rotation
from farhand.evaluation.paper.closed_loop import Disturbance

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
