"""Measurements of one control period: effector and task frames, which are predicted while briefly unseen.

`Perception` is the interface to the robot's sight of its task frames.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from farhand.common.errors import InvalidInput
from farhand.common.model.task_frame import TaskFrame
from farhand.remote_site.interface.driver import Monitored
from farhand.remote_site.interface.plant import Plant, are_plausible, check_state

Array = NDArray[np.float64]


class Perception(Protocol):
    """Sight of the surroundings, local to the remote site and without delay.

    What it may have besides: `Startable`, `Closable`, `Haltable`, `Monitored`, and `TrueTarget` in a simulation.
    """

    def observe(self, now_s: float) -> list[TaskFrame] | None:
        """Return the task frames as estimated now, in the order of the task's `frame_names`; None while unseen."""
        ...


@runtime_checkable
class TrueTarget(Protocol):
    """Knowledge of where the target really is, as a simulation's perception has it."""

    def true_origin_m(self, now_s: float) -> Array | None:
        """Return the true origin of the goal's frame, the last one; None if it is unknown now. Shape (D,) [m]."""
        ...


def check_frames(frames: list[TaskFrame], n_frames: int, n_dims: int) -> None:
    """Check what a perception's `observe` returned, in form.

    Args:
        frames: Task frames.
        n_frames: Number P of task frames of the task.
        n_dims: Dimension D.

    Raises:
        InvalidInput: When it is no list of so many frames of that dimension, with origins within a million metres.
    """
    if not isinstance(frames, list) or any(not isinstance(frame, TaskFrame) for frame in frames):
        raise InvalidInput("perception", "observe", f"a list of TaskFrame, or None; got {frames!r:.80}")
    if len(frames) != n_frames:
        expected = f"{n_frames} task frames, as the task's frame_names has, got {len(frames)}"
        raise InvalidInput("perception", "observe", expected)
    for frame in frames:
        if frame.b.shape != (n_dims,):
            raise InvalidInput("perception", "observe", f"frames of {n_dims} dimensions, got {frame.n_dims}")
        if not are_plausible(frame.b):
            raise InvalidInput("perception", "observe", "no origin beyond a million metres")


PREDICTED_S = 0.3
"""Time for which an unseen frame is extrapolated [s]."""
_MEAN_FRAME_S = 10.0
_VELOCITY_S = 0.2


@dataclass(frozen=True)
class SeenAgain:
    """End of a gap in sight, in the control period in which the task frames are seen again.

    Args:
        gap_s: Duration of the gap [s].
        moved_m: Distance of the goal's frame from its prediction [m].
        turned_rad: Rotation of the goal's frame from its prediction [rad].
    """

    gap_s: float
    moved_m: float
    turned_rad: float


class Sensing:
    """Newest measurements of a robot and its surroundings.

    Args:
        plant: The robot.
        perception: Sight of the robot.
        n_frames: Number of task frames.
        control_hz: Rate at which `update` is called [Hz].
        now_s: Present time [s].

    Raises:
        InvalidInput: When a measurement is not of the agreed form, here and in `update`.
    """

    def __init__(self, plant: Plant, perception: Perception, n_frames: int, control_hz: float, now_s: float):
        self._plant, self._perception, self._n_frames = plant, perception, n_frames
        self._monitored = [driver for driver in (plant, perception) if isinstance(driver, Monitored)]
        self._seen: deque[list[TaskFrame]] = deque(maxlen=max(1, round(_MEAN_FRAME_S * control_hz)))
        self._recent: deque[tuple[float, list[TaskFrame]]] = deque()
        self._seen_s = -np.inf
        self.effector = first = plant.read()
        """Newest plausible state."""
        self.is_plausible = first.is_plausible
        """Whether the newest reading was plausible: no other enters an estimate or a report."""
        self._shape, self._n_dims = (first.point.size, first.velocity.size), first.n_dims
        self.seen = [TaskFrame.identity(self.effector.position_m.size)] * n_frames
        """Task frames as seen, or as predicted while unseen."""
        self.frames = self.seen
        """Believed task frames, set by the supervisor in each period; as seen until then."""
        self.seen_again: SeenAgain | None = None
        self.unseen_s = np.inf
        """Time for which the frames have been unseen [s].

        Zero while seen, infinite before the first sight.
        """
        self.update(now_s)

    def update(self, now_s: float) -> None:
        """Measure the effector and the task frames."""
        effector = self._plant.read()
        check_state(effector, *self._shape)
        self.is_plausible = effector.is_plausible
        if self.is_plausible:
            self.effector = effector
        observed = self._perception.observe(now_s)
        self.seen_again = None
        if observed is None:
            self.unseen_s = now_s - self._seen_s
            self.seen = self.frames = self._predicted()
            return
        check_frames(observed, self._n_frames, self._n_dims)
        if 0.0 < self.unseen_s < np.inf:
            self.seen_again = SeenAgain(now_s - self._seen_s, *apart(self.seen[-1], observed[-1]))
        self.seen = self.frames = observed
        self._seen_s, self.unseen_s = now_s, 0.0
        self._seen.append(observed)
        self._recent.append((now_s, observed))
        while self._recent[0][0] < now_s - _VELOCITY_S - 1e-9:
            self._recent.popleft()

    @property
    def fault(self) -> str:
        """Fault that the machine or its sight tells, in words; empty for none."""
        return next((str(told) for driver in self._monitored if (told := driver.fault)), "")

    @property
    def goal(self) -> TaskFrame:
        """Believed task frame of the goal: the last one."""
        return self.frames[-1]

    def mean_frames(self) -> list[TaskFrame]:
        """Return the task frames, each averaged over its movement."""
        return [_mean(frames) for frames in zip(*(self._seen or [self.seen]), strict=True)]

    def _predicted(self) -> list[TaskFrame]:
        """Return the frames extrapolated for a moment; after that they stand still."""
        if not self._recent:
            return self.seen
        (before_s, before), (last_s, last) = self._recent[0], self._recent[-1]
        ratio = min(self.unseen_s, PREDICTED_S) / max(last_s - before_s, 1e-9)
        return [_gone_on(*pair, ratio) for pair in zip(before, last, strict=True)]


def _mean(frames: Sequence[TaskFrame]) -> TaskFrame:
    U, _, Vt = np.linalg.svd(np.mean([frame.A for frame in frames], axis=0))
    return TaskFrame(U @ Vt, np.mean([frame.b for frame in frames], axis=0))


def _gone_on(before: TaskFrame, last: TaskFrame, ratio: float) -> TaskFrame:
    """Extrapolate a frame by a multiple of its motion from an earlier frame to the last one."""
    turn = np.eye(3)  # a rotation of the plane is one of space about the third axis
    turn[: last.n_dims, : last.n_dims] = before.A.T @ last.A
    further = Rotation.from_rotvec(ratio * Rotation.from_matrix(turn).as_rotvec()).as_matrix()
    A = last.A @ further[: last.n_dims, : last.n_dims]
    return TaskFrame(A, last.b + ratio * (last.b - before.b))


def apart(one: TaskFrame, other: TaskFrame) -> tuple[float, float]:
    """Return the distance of the origins [m], and the angle between the axes [rad]."""
    turn = one.A.T @ other.A
    # A rotation's distance to the identity gives its angle, in the plane and in space.
    angle = 2.0 * math.asin(min(1.0, float(np.linalg.norm(turn - np.eye(len(turn)))) / math.sqrt(8.0)))
    return float(np.linalg.norm(other.b - one.b)), angle
