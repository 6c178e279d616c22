"""Operator's arm with the hand that holds it, stepped one control period at a time, in the arm's own time.

`ArmPlace` has the common part of the two kinds of workcell with an arm.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from farhand.common.arm.cell import Cell
from farhand.common.arm.simulation.simulation import TICK_S
from farhand.common.arm.simulation.starts_and_goals import Box, Placement
from farhand.common.errors import InvalidDemonstration, InvalidInput
from farhand.common.model.manifold import POSE
from farhand.common.model.task_frame import TaskFrame
from farhand.common.task import AnyTask, ArmTask
from farhand.local_site.teaching.demonstration import Demonstration
from farhand.local_site.workcell.arm_view import ArmView
from farhand.local_site.workcell.hand_motion import HandMotion, HandRamp
from farhand.local_site.workcell.operator_arm import OperatorArm
from farhand.local_site.workcell.workcell import SampleFiles, no_files

Array = NDArray[np.float64]
SkillName = Literal["insert", "extract"]

_REST_S = 1.0
_STILL_M_S, _AWAY_M, _STUCK_S = 0.01, 0.025, 0.3
_SETTLED_S = 0.3
"""Duration of a standstill [s]."""
_NEAR_M = 3e-4
"""An arm at most so far from the hand has come to it: a slow arm counts as still well before [m]."""
_RADIAN_M = 0.2
"""Weight of a radian beside metres [m/rad]."""
_FAR_M = 10.0


class Moved(NamedTuple):
    """Path of the arm while a hand held it.

    Args:
        points: Poses of the plug's tip. Shape (n, 7).
        times_s: Times in the arm's own time. Shape (n,) [s].
    """

    points: Array
    times_s: Array


class HeldArm:
    """Arm that follows the hand that holds it, and stands still without one.

    Args:
        skill: `insert` for a plug to insert, `extract` for one that starts seated.
        cell: The arm in front of its receptacle.
        seed: Seed of the first placement of arm and receptacle.
    """

    def __init__(self, skill: SkillName, cell: Cell, seed: int):
        self._cell = cell
        self._arm = OperatorArm(cell, self._placement(skill, seed), presses=skill == "insert")
        self._target: Array | None = None
        self._ramp: HandRamp | None = None
        self._n_ticks = self._n_still = self._n_stuck = 0
        self._tip, self._seed = self._arm.tip, seed
        self._points: list[Array] = []
        self._times_s: list[float] = []

    @property
    def seed(self) -> int:
        """Seed of the present placement of arm and receptacle."""
        return self._seed

    @property
    def asleep(self) -> bool:
        """True while the arm stands and no hand holds it: it need not be stepped."""
        return self._target is None and self._n_still * TICK_S >= _REST_S

    @property
    def held(self) -> bool:
        """True while a hand holds the arm, or moves it as it was asked to."""
        return self._target is not None

    def hold(self, target: Array) -> None:
        """Move the hand, which holds the arm from now on, to a pose relative to the arm's base. Shape (7,)."""
        self._target, self._ramp = target, None

    def lead(self, motion: HandMotion) -> None:
        """Move the arm by the hand, evenly, to a goal, and let go there; motions under way add up."""
        ramp = self._ramp or HandRamp(self._arm.tip, self._arm.tip)
        self.hold(ramp.pose)
        self._n_still = 0
        self._ramp = HandRamp(ramp.pose, motion(ramp.goal, self._arm.receptacle))

    def let_go(self) -> None:
        """Release the arm."""
        self._target, self._n_still, self._n_stuck, self._ramp = None, 0, 0, None

    def tick(self) -> None:
        """Step one control period."""
        # A rest between two holds is no part of a demonstration: the robot would repeat it as a pause.
        self._n_ticks += self._target is not None or not self._still
        if self._ramp is not None:
            self._target = self._ramp.step(TICK_S)
        if self._target is None:
            self._arm.brake()
        else:
            self._arm.follow(self._target)
            self._points.append(self._arm.tip)
            self._times_s.append(self._n_ticks * TICK_S)
        self._notice()
        if self._ramp is not None and self._ramp.arrived and self._has_come:
            self.let_go()

    def take(self) -> Moved:
        """Return the path since the last call."""
        moved = Moved(np.array(self._points).reshape(-1, POSE.n_coordinates), np.array(self._times_s))
        self._points, self._times_s = [], []
        return moved

    def reset(self, skill: SkillName, seed: int) -> None:
        """Place arm and receptacle at a start of this skill; the hand lets go."""
        self._arm.put(self._placement(skill, seed), presses=skill == "insert")
        self._seed, self._tip = seed, self._arm.tip
        self.let_go()
        self.take()

    def view(self) -> ArmView:
        """Return a snapshot of the arm."""
        arm, insertion = self._arm, self._arm.insertion
        return ArmView(
            joints_rad=arm.joints_rad,
            tip=arm.tip,
            receptacle=arm.receptacle,
            depth_m=insertion.depth_m,
            lateral_m=insertion.lateral_m,
            tilt_rad=insertion.tilt_rad,
            held=self.held,
            saturated=self._n_stuck * TICK_S >= _STUCK_S,
            still=self._still,
            seed=self._seed,
            bore_m=self._cell.receptacle.depth_m,
        )

    def _placement(self, skill: SkillName, seed: int) -> Placement:
        place = Placement.sample if skill == "insert" else Placement.seated
        return place(np.random.default_rng(seed), Box.of(self._cell.robot), self._cell)

    def _notice(self) -> None:
        """Detect whether the arm stands still, and whether it no longer approaches the hand."""
        before, self._tip = self._tip, self._arm.tip
        least_m = _STILL_M_S * TICK_S
        still = POSE.distance(before, self._tip, _RADIAN_M) < least_m
        self._n_still = self._n_still + 1 if still else 0
        stuck = self._target is not None and self._away_m(self._tip) > max(
            _AWAY_M, self._away_m(before) - least_m
        )
        self._n_stuck = self._n_stuck + 1 if stuck else 0

    @property
    def _has_come(self) -> bool:
        """True if the arm stands at the hand, or has stood for longer, because it comes no nearer."""
        near = self._still and self._away_m(self._tip) < _NEAR_M
        return near or self._n_still * TICK_S >= _REST_S

    @property
    def _still(self) -> bool:
        return self._n_still * TICK_S >= _SETTLED_S

    def _away_m(self, tip: Array) -> float:
        assert self._target is not None
        return float(POSE.distance(tip, self._target, _RADIAN_M))


def hand_pose(point: ArrayLike) -> Array:
    """Return the hand's pose, clipped to a distance that keeps the numbers finite. Shape (7,).

    Raises:
        InvalidDemonstration: When the point is no pose.
    """
    try:
        pose = POSE.checked(point, "hand", "point")
    except InvalidInput as error:
        raise InvalidDemonstration("hand", error.field, error.expected) from None
    pose[:3] = np.clip(pose[:3], -_FAR_M, _FAR_M)
    return pose


class ArmPlace:
    """Base of the workcells with an arm in front of its receptacle, whose frame is the last task frame.

    Args:
        task: First task.
        cell: The operator's arm in front of its receptacle.
        sample_files: Returns the files of demonstrations that come with a task.
        seed: Seed of the first placement of arm and receptacle.
    """

    def __init__(self, task: ArmTask, cell: Cell, sample_files: SampleFiles = no_files, seed: int = 0):
        self._task, self._sample_files = task, sample_files
        self._arm = HeldArm(task.skill, cell, seed)
        self.view: ArmView = self._arm.view()
        """Newest snapshot of the arm."""

    @property
    def frames(self) -> list[TaskFrame]:
        """Task frames. Length P."""
        return [*self._task.still_frames, TaskFrame.at(self.view.receptacle)]

    def switch_task(self, task: AnyTask) -> None:
        """See `Workcell.switch_task`."""
        assert isinstance(task, ArmTask), "a repertoire is of one robot"
        self._task = task
        self.reset(self.view.seed)

    def reset(self, seed: int | None) -> None:
        """See `Workcell.reset`."""
        raise NotImplementedError

    def samples(self) -> list[Demonstration]:
        """See `Workcell.samples`."""
        return [Demonstration.load(file) for file in self._sample_files(self._task.name)]
