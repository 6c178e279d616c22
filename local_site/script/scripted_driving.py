"""Demonstration made on the robot: the scripted operator drives it through the motion while it records."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from msgspec import UNSET
from numpy.typing import NDArray

from farhand.common.mode_table import Action, ControlMode
from farhand.common.model.manifold import POSE
from farhand.common.model.task_frame import TaskFrame
from farhand.common.task import AnyTask, ArmTask
from farhand.common.wire.messages import Telemetry
from farhand.local_site.console import intents
from farhand.local_site.script.scripted_actions import JobFailed, ScriptedActions

if TYPE_CHECKING:
    from farhand.local_site.workcell.scripted_hand import ScriptedPath

Array = NDArray[np.float64]
Hand = Callable[[float, Telemetry], tuple[float, ...]]
"""Pose of the hand at a time [s], given the robot's shown report. Length C."""

_HAND_PERIOD_S = 1.0 / 30.0
_FETCH_S = 600.0
_REACH_S, _REST_S = 4.0, 0.5
_STANDS_M, _STANDS_S, _PATIENCE_S, _PUSH_M_S = 0.001, 1.0, 12.0, 0.02
_UPRIGHT = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])


def demonstrate_by_driving(task: AnyTask, actions: ScriptedActions, seed: int) -> None:
    """Couple, have the robot record, drive to the goal, end, and wait until the recording is learned.

    Args:
        task: Task to demonstrate.
        actions: Actions at the console; the robot must be in HOLD at the start of the motion.
        seed: Seed of the path.

    Raises:
        JobFailed: When a step failed.
    """
    actions.command(Action.COUPLE, ControlMode.DIRECT)
    state = actions.picture
    n, robot = state.n_demonstrations, state.robot
    assert robot is not None
    hand, duration_s = _hand_for(task, robot, seed)
    actions.submit(intents.RecordDemonstration())
    actions.until("the robot's recording", lambda p: p.robot_records)
    _drive(actions, hand, duration_s, _PATIENCE_S if isinstance(task, ArmTask) else 0.0)
    if not actions.picture.robot_records:
        raise JobFailed(f"the robot did not record to the end: {actions.last_words()}")
    actions.submit(intents.EndDemonstration())
    actions.until("the robot's recording to be learned", lambda p: p.n_demonstrations == n + 1, _FETCH_S)
    actions.say(f"demonstration {n + 1}, driven: recorded by the robot, fetched and learned")
    actions.command(Action.CLUTCH, ControlMode.HOLD)


def _drive(actions: ScriptedActions, hand: Hand, duration_s: float, patience_s: float) -> None:
    """Move the hand, and hold it at the end until the robot's reports show that it stands."""
    began_s, seen_s, seen_m = actions.time.now_s(), 0.0, np.array(np.inf)
    while (t := actions.time.now_s() - began_s) < duration_s + patience_s:
        robot = actions.picture.robot
        assert robot is not None
        if t >= max(duration_s, seen_s + _STANDS_S):
            if np.linalg.norm(robot.position_m - seen_m) < _STANDS_M:
                return
            seen_m, seen_s = np.array(robot.position_m), t
        actions.submit(intents.Hand(hand(t, robot), t))
        actions.time.pause(_HAND_PERIOD_S)


def _hand_for(task: AnyTask, robot: Telemetry, seed: int) -> tuple[Hand, float]:
    """Return the hand's pose over time, and the duration of the drive [s]."""
    if not isinstance(task, ArmTask):
        start = np.array(robot.position_m)

        def to_target(t: float, seen: Telemetry) -> tuple[float, ...]:
            return tuple((start + _eased(t / _REACH_S) * (seen.frame_origin_m - start)).tolist())

        return to_target, _REACH_S + _REST_S
    frame = TaskFrame.at(_pose(robot.frame_origin_m, robot.frame_rotation_rad))
    turn = robot.arm.rotation_rad if robot.arm is not UNSET else ()
    way = _way(task, frame.to_local(_pose(robot.position_m, turn)), np.random.default_rng(seed))

    def along_way(t: float, _seen: Telemetry) -> tuple[float, ...]:
        position, turn, _ = way.at(t)
        if task.skill == "insert":
            position[2] += _PUSH_M_S * max(t - way.duration_s, 0.0)  # until the plug goes no deeper
        pose = np.concatenate([position, turn.as_quat(scalar_first=True)])
        return tuple(frame.to_world(pose).tolist())

    return along_way, way.duration_s


def _way(task: ArmTask, start: Array, random: np.random.Generator) -> ScriptedPath:
    # Importing the physics takes a second, and a board does not need them.
    from farhand.common.arm.cell import Receptacle
    from farhand.local_site.workcell.scripted_hand import ScriptedExtraction, ScriptedInsertion

    return (
        ScriptedInsertion(start, Receptacle().depth_m, random)
        if task.skill == "insert"
        else ScriptedExtraction(start, random)
    )


def _pose(position_m: tuple[float, ...], rotation_rad: tuple[float, ...]) -> Array:
    return POSE.exp(_UPRIGHT, np.array([*position_m, *(rotation_rad or (0.0, 0.0, 0.0))]))


def _eased(part: float) -> float:
    part = min(max(part, 0.0), 1.0)
    return part * part * (3.0 - 2.0 * part)
