"""Skills of the scripted operator's hand: demonstrate a task, and drive the robot a little."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from farhand.common.model.task_frame import TaskFrame
from farhand.common.task import AnyTask, ArmTask, PointTask
from farhand.local_site.console import intents
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.script.scripted_actions import ATTEMPTS, JobFailed, ScriptedActions
from farhand.local_site.teaching.plausibility import ARM_PERIOD_S
from farhand.local_site.teaching.samples import sample_strokes
from farhand.local_site.workcell.arm_view import ArmView

if TYPE_CHECKING:
    from farhand.local_site.workcell.scripted_hand import ScriptedPath

Array = NDArray[np.float64]

_DRIVE_M, _DRIVE_RAD, _DRIVE_RAD_S = 0.05, 0.1, 4.0
_ARM_DEMONSTRATIONS = 5
_HAND_S = 0.05
_AHEAD = 2
"""Largest number of the hand's events that wait for the console."""
_PATIENT_ATTEMPTS = 10
_SEATED_M, _LATERAL_M, _OUT_M = 0.010, 0.004, 0.10


class ScriptedSkill(Protocol):
    """Hand for one kind of task."""

    n_demonstrations: int
    """Number of demonstrations."""

    def demonstrate(self, number: int) -> None:
        """Make one demonstration, from Record to End.

        Args:
            number: Number of the demonstration, from 1.

        Raises:
            JobFailed: When the demonstration failed.
        """
        ...

    def driving(self, time_s: float) -> tuple[float, ...]:
        """Return the hand's pose while it drives the robot. Length C."""
        ...


def skill_for(task: AnyTask, actions: ScriptedActions, seed: int) -> ScriptedSkill:
    """Return the skill that a task needs.

    Args:
        task: The task.
        actions: Actions at the console.
        seed: Seed of all variations of the hand.
    """
    return (
        DrawingSkill(task, actions, seed)
        if isinstance(task, PointTask)
        else LeadingSkill(task, actions, seed)
    )


class DrawingSkill:
    """Hand that draws the strokes of a task's samples, with a tremor.

    Args:
        task: The task.
        actions: Actions at the console.
        seed: Seed of the tremor.
    """

    def __init__(self, task: PointTask, actions: ScriptedActions, seed: int):
        self._actions, self._task = actions, task
        self._strokes = sample_strokes(task, seed)
        self.n_demonstrations = len(self._strokes)

    def demonstrate(self, number: int) -> None:
        """See `ScriptedSkill.demonstrate`."""
        stroke = self._strokes[number - 1]
        if self._task.varies:
            self._actions.submit(intents.ResetArm(number - 1))
            self._actions.until(
                "the frames at their place", lambda p: _among(p.own_frames, stroke.frames_at(0))
            )
        self._actions.submit(intents.RecordDemonstration())
        for position, time_s in zip(stroke.position_m, stroke.time_s, strict=True):
            self._actions.submit(intents.Hand(tuple(position.tolist()), float(time_s)))
        self._actions.submit(intents.EndDemonstration())

    def driving(self, time_s: float) -> tuple[float, ...]:
        """Return the hand's pose while it drives the robot. Length C."""
        angle = _DRIVE_RAD_S * time_s
        return (_DRIVE_M * math.cos(angle), _DRIVE_M * math.sin(angle), *[0.0] * (self._task.n_dims - 2))


def _among(frames: Sequence[TaskFrame], wanted: Sequence[TaskFrame]) -> bool:
    return all(np.array_equal(one.b, other.b) for one, other in zip(frames, wanted, strict=True))


class LeadingSkill:
    """Hand that guides the operator's arm into its receptacle, or out of it, from a different start each time.

    Args:
        task: The task.
        actions: Actions at a console whose arm must be a `SteppedArm`, which does not run in real time.
        seed: Seed of the starts and of the hand.
    """

    def __init__(self, task: ArmTask, actions: ScriptedActions, seed: int):
        # Importing the physics takes a second, and a board does not need them.
        from farhand.common.arm.cell import Receptacle

        self._actions, self._inserts, self._seed = actions, task.skill == "insert", seed
        self._depth_m = Receptacle().depth_m
        self.n_demonstrations = _ARM_DEMONSTRATIONS

    def demonstrate(self, number: int) -> None:
        """See `ScriptedSkill.demonstrate`; a failed demonstration is undone and retried from another start."""
        seed, n_failed = 1000 * self._seed + 10 * number, 0
        for _ in range(_PATIENT_ATTEMPTS):
            arm = self._lead(number, seed)
            if not self._actions.picture.recording:
                # For example, the control was lost for a moment: repeat the same demonstration.
                self._actions.say(f"demonstration {number} was interrupted: {self._actions.last_words()}")
                continue
            if self._done(arm):
                self._actions.submit(intents.EndDemonstration())
                return
            self._actions.submit(intents.Undo())
            self._actions.say(f"demonstration {number} ended {arm.depth_m * 1e3:.0f} mm deep: retrying")
            seed, n_failed = seed + 1, n_failed + 1
            if n_failed == ATTEMPTS:
                break
        raise JobFailed(f"demonstration {number} failed in all attempts")

    def driving(self, time_s: float) -> tuple[float, ...]:
        """Return the hand's pose while it drives the robot. Length C."""
        angle = _DRIVE_RAD_S * time_s
        if not self._inserts:
            return (0.5 * _DRIVE_M * (math.cos(angle) - 1.0), 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
        turn = Rotation.from_rotvec([0.0, 0.0, _DRIVE_RAD * math.sin(angle)]).as_quat(scalar_first=True)
        return (0.0, _DRIVE_M * math.cos(angle), _DRIVE_M * math.sin(angle), *turn.tolist())

    def _lead(self, number: int, seed: int) -> ArmView:
        """Record one motion without ending it; return the arm at its end."""
        from farhand.local_site.workcell.scripted_hand import ScriptedHand

        for there in (
            seed + 1,
            seed,
        ):  # reset to another place first, because the arm may already be at this one
            self._actions.submit(intents.ResetArm(there))
            self._actions.until("the arm at its place", lambda p, k=there: _arm(p).seed == k)
        before = _arm(self._actions.picture)
        frame, random = TaskFrame.at(before.receptacle), np.random.default_rng(seed)
        hand = ScriptedHand(self._way(frame.to_local(before.tip), random), random)
        self._actions.submit(intents.RecordDemonstration())
        self._actions.until("the recording", lambda p: p.recording)
        n_events = math.ceil(hand.duration_s / _HAND_S)
        for k in range(n_events):
            pose = frame.to_world(hand.target(_HAND_S * k))
            self._actions.submit(intents.Hand(tuple(pose.tolist()), _HAND_S * k))
            if k % _AHEAD == _AHEAD - 1:
                # Leave the console time for the robot's messages.
                self._actions.until(f"demonstration {number}", _as_far_as(number, _HAND_S * k))
        self._actions.submit(intents.Hand(tuple(before.tip.tolist()), _HAND_S * n_events, released=True))
        return _arm(self._actions.until(f"demonstration {number}", _let_go_after(number)))

    def _way(self, start: Array, random: np.random.Generator) -> ScriptedPath:
        from farhand.local_site.workcell.scripted_hand import ScriptedExtraction, ScriptedInsertion

        return (
            ScriptedInsertion(start, self._depth_m, random)
            if self._inserts
            else ScriptedExtraction(start, random)
        )

    def _done(self, arm: ArmView) -> bool:
        if not self._inserts:
            return arm.depth_m < -_OUT_M
        return arm.depth_m > self._depth_m - _SEATED_M and arm.lateral_m < _LATERAL_M


def _as_far_as(number: int, time_s: float) -> Callable[[ConsoleState], bool]:
    n_points = round(time_s / ARM_PERIOD_S) - 1
    return lambda p: not p.recording or (len(p.strokes) == number and len(p.strokes[-1]) >= n_points)


def _let_go_after(number: int) -> Callable[[ConsoleState], bool]:
    return lambda p: not p.recording or (len(p.strokes) == number and not _arm(p).held)


def _arm(state: ConsoleState) -> ArmView:
    assert state.own_arm is not None
    return state.own_arm
