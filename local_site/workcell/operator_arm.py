"""Operator's own arm: simulated, with its own receptacle and contact; it follows the operator's hand."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from farhand.common.arm.cell import Cell
from farhand.common.arm.compliance import SeenReceptacle
from farhand.common.arm.servo import Servo, ServoSettings
from farhand.common.arm.setpoint import MotionLimits
from farhand.common.arm.simulation.disturbances import Surroundings
from farhand.common.arm.simulation.simulation import TICK_S, Insertion, Simulation
from farhand.common.arm.simulation.starts_and_goals import Box, Placement
from farhand.common.errors import FarhandError
from farhand.common.model.task_frame import TaskFrame
from farhand.local_site.teaching.demonstration import Demonstration
from farhand.local_site.workcell.scripted_hand import (
    STANDOFF_M,
    ScriptedExtraction,
    ScriptedHand,
    ScriptedInsertion,
    ScriptedPath,
)

Array = NDArray[np.float64]

FRAME_NAME = "receptacle"
_SPEED_M_S = 0.25
_SEATED_M, _LATERAL_M = 0.075, 0.004
_STANDOFF_M = 0.015  # a plug at least this far before the mouth is out


class OperatorArm:
    """Arm in calm water in front of a receptacle that stands still and is known exactly.

    Args:
        cell: Arm and receptacle.
        placement: First placement of arm and receptacle.
        presses: True if a plug in the bore is to be pressed in, False if it is to be extracted.
    """

    def __init__(self, cell: Cell, placement: Placement, presses: bool = True):
        self._cell, self._simulation = cell, Simulation(cell)
        self.put(placement, presses)

    def put(self, placement: Placement, presses: bool = True) -> None:
        """Place arm and receptacle, at rest."""
        receptacle, joints_rad = placement
        self._around = Surroundings.still(self._cell).with_receptacle(receptacle)
        self._simulation.reset(joints_rad, self._around)
        settings = ServoSettings(MotionLimits.of(self._cell.robot))
        self._servo = Servo(self._cell, settings, self._simulation.joints_rad)
        self._servo.set_receptacle(SeenReceptacle(receptacle, np.zeros(6)), presses)
        self.receptacle, self.frame = receptacle, TaskFrame.at(receptacle)

    def follow(self, pose: Array) -> None:
        """Follow the hand for one control period. A pose relative to the arm's base. Shape (7,)."""
        self._step(self._servo.follow(pose, _SPEED_M_S, TICK_S))

    def brake(self) -> None:
        """Brake, or hold still, for one control period."""
        self._step(self._servo.brake(TICK_S))

    def _step(self, joint_velocities: Array) -> None:
        self._simulation.step(joint_velocities, self._around)
        self._servo.measure(self._simulation.joints_rad, self._simulation.wrench)

    @property
    def joints_rad(self) -> Array:
        """Joint angles. Shape (N,) [rad]."""
        return self._simulation.joints_rad

    @property
    def tip(self) -> Array:
        """Pose of the plug's tip relative to the arm's base. Shape (7,)."""
        return self._servo.tip

    @property
    def insertion(self) -> Insertion:
        """Place of the plug in the receptacle."""
        return self._simulation.insertion


class NotDemonstrated(FarhandError):
    """Failure of the scripted operator to demonstrate the task."""


def hot_stab(seed: int, cell: Cell) -> Demonstration:
    """Return one insertion by the scripted operator, recorded at 100 Hz.

    Args:
        seed: Seed of the start and of the hand.
        cell: Arm and receptacle.

    Raises:
        NotDemonstrated: When the plug is not seated at the end.
    """
    random, box = np.random.default_rng(seed), Box.of(cell.robot)
    arm = OperatorArm(cell, Placement.sample(random, box, cell))
    way = ScriptedInsertion(arm.frame.to_local(arm.tip), cell.receptacle.depth_m, random)
    shown = _demonstrate(arm, way, random, seed)
    end = arm.insertion
    if end.depth_m < _SEATED_M or end.lateral_m > _LATERAL_M:
        raise NotDemonstrated(f"seed {seed}: the plug ends {end.depth_m * 1e3:.0f} mm deep")
    return shown


def hot_stab_removal(seed: int, cell: Cell) -> Demonstration:
    """Return one extraction by the scripted operator, held before the mouth, recorded at 100 Hz.

    Args:
        seed: Seed of the start and of the hand.
        cell: Arm and receptacle.

    Raises:
        NotDemonstrated: When the plug is not held before the mouth at the end.
    """
    random, box = np.random.default_rng(seed), Box.of(cell.robot)
    arm = OperatorArm(cell, Placement.seated(random, box, cell), presses=False)
    shown = _demonstrate(arm, ScriptedExtraction(arm.frame.to_local(arm.tip), random), random, seed)
    away_m = float(np.linalg.norm(shown.in_frame()[-1] + np.array([0.0, 0.0, STANDOFF_M])))
    if away_m > _STANDOFF_M:
        raise NotDemonstrated(f"seed {seed}: the plug ends {away_m * 1e3:.0f} mm off")
    return shown


DEMONSTRATIONS: dict[str, Callable[[int, Cell], Demonstration]] = {
    "hot-stab": hot_stab,
    "hot-stab-removal": hot_stab_removal,
}
"""Scripted demonstration of each task, as a function of its seed and the arm."""


def demonstrations(
    task: str,
    n: int,
    first_seed: int,
    cell: Cell,
    left_out: Callable[[NotDemonstrated], None] = lambda _: None,
) -> Iterator[Demonstration]:
    """Iterate over the demonstrations of the first seeds that reach their end.

    Args:
        task: One of `DEMONSTRATIONS`.
        n: Number of demonstrations.
        first_seed: Seed from which on all are tried in turn.
        cell: Arm and receptacle.
        left_out: Called with the reason for each seed that is left out.

    Raises:
        NotDemonstrated: When more than n seeds would be left out.
    """
    found, failed = 0, 0
    while found < n:
        try:
            shown = DEMONSTRATIONS[task](first_seed + found + failed, cell)
        except NotDemonstrated as error:
            failed += 1
            if failed > n:
                raise
            left_out(error)
            continue
        found += 1
        yield shown


def _demonstrate(
    arm: OperatorArm, way: ScriptedPath, random: np.random.Generator, seed: int
) -> Demonstration:
    hand = ScriptedHand(way, random)
    time_s = TICK_S * np.arange(round(hand.duration_s / TICK_S) + 1, dtype=np.float64)
    poses = [arm.tip]
    for t in time_s[:-1]:
        arm.follow(arm.frame.to_world(hand.target(float(t))))
        poses.append(arm.tip)
    points = np.stack(poses)
    return Demonstration(
        time_s=time_s,
        position_m=points[:, :3],
        quat_wxyz=points[:, 3:],
        frame_origin_m=arm.frame.b[None],
        frame_rotation=arm.frame.A[None],
        frame_names=(FRAME_NAME,),
        source=f"scripted operator, seed {seed}",
    )
