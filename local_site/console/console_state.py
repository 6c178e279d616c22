"""Complete state of the console at one moment: one immutable value, made by the console alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from msgspec import UNSET
from numpy.typing import NDArray

from farhand.common.mode_table import Action, ControlMode, Phase
from farhand.common.model.task_frame import TaskFrame
from farhand.common.model.tphsmm import TPHSMM
from farhand.common.task import AnyTask, ArmTask, PointTask
from farhand.common.wire.messages import PlannedPath, Telemetry, Wish
from farhand.common.wire.reasons import Reason
from farhand.common.wire.scene_description import SceneDescription
from farhand.local_site.console.executions import Executions
from farhand.local_site.exchange.camera import CameraState
from farhand.local_site.exchange.notices import Notice
from farhand.local_site.exchange.report_age import LinkView
from farhand.local_site.exchange.stop_sender import StopStatus
from farhand.local_site.teaching.demonstration import Demonstration
from farhand.local_site.teaching.lesson import LearnedModel
from farhand.local_site.teaching.revisions import Revision
from farhand.local_site.workcell.arm_view import ArmView


@dataclass(frozen=True)
class Pending:
    """Action that was asked for and is not settled.

    Args:
        command_id: Id of the command.
        since_s: Time of the request, on the console's clock [s].
        accepted_ns: Time of the robot's acceptance, on the robot's clock [ns]; None before its answer.
        leads_to: Mode to which the action leads, according to the robot.
    """

    command_id: str
    since_s: float
    accepted_ns: int | None = None
    leads_to: ControlMode | None = None


@dataclass(frozen=True)
class TaskStanding:
    """Standing of one task: what was taught, and what the robot has.

    Args:
        name: Name of the task.
        n_demonstrations: Number of learned demonstrations.
        learned_sha256: SHA-256 of the model; empty while nothing was taught.
        model_bytes: Size of the model [B].
        confirmed_sha256: SHA-256 of the model that the robot confirmed last; empty without one.
        sending_sha256: SHA-256 of its model that is being sent, or waits for another task's; empty for none.
        asking: True while the robot is asked whether it has the model.
        robot_does: True if the robot does this task, as far as is known.
    """

    name: str
    n_demonstrations: int
    learned_sha256: str
    model_bytes: int
    confirmed_sha256: str
    sending_sha256: str
    asking: bool
    robot_does: bool

    @property
    def differs(self) -> bool:
        """True if the robot has not confirmed the learned model of a task that it does."""
        return self.robot_does and self.learned_sha256 not in ("", self.confirmed_sha256)


@dataclass(frozen=True)
class ConsoleState:
    """Complete state of the console.

    Args:
        now_s: Time of its making, on the console's clock [s].
        robot: Newest report of the robot; None before the first one.
        robot_version: Version of the robot's Farhand, empty while unknown.
        robot_tasks: Tasks that the robot does, none while unknown.
        other_schema: Reason why the robot's messages are not understood, when their version differs.
        link: State of the link.
        in_control: True if this site holds the lease.
        why_not_in_control: The robot's reason when it does not.
        wish: Wish of this site about the control.
        asked_by: Name of the site that asks this one for the control, empty for none.
        pending: Actions that are not settled.
        notices: Messages for the operator, the newest last.
        task: Chosen task; the following fields are about it.
        tasks: Standing of all tasks, in their order.
        sending_library: True while the library is being sent.
        recording: True while a demonstration is recorded.
        demonstrations: Learned demonstrations, in their order.
        demonstration_names: Names of their files.
        can_undo: True if a demonstration can be undone.
        can_recover: True if a demonstration recorded here, or by the robot, was not learned yet.
        fetching: Share of a robot's recording that has arrived, from 0 to 1; None while none is fetched.
        robot_scene: Drawing of the robot; None while unknown.
        scene_fetching: Share of the drawing that has arrived, from 0 to 1; None while it is not fetched.
        learned: Model of all ended demonstrations.
        forming: Model including the demonstration in progress, None without one.
        confirmed_sha256: SHA-256 of the model that the robot confirmed last.
        robot_model: Model that the robot confirmed last; None without one.
        miss: Distance of an ended demonstration from the goal, in words, while the operator is asked whether to
            keep it; empty otherwise.
        auto_send: True if a model is sent whenever it changes.
        revisions: Newest revisions of the task, the newest last.
        revision: Number of the current revision, 0 before the first.
        strokes: Demonstrations, each of shape (T, C), the one in progress last: positions on the board [m],
            or poses relative to the base of the operator's arm.
        stroke_frames: Task frames in which each stroke was made. Each of length P.
        own_frames: Present task frames of the workcell. Length P.
        own_arm: Snapshot of the operator's arm; None where a hand alone demonstrates.
        executions: Executions that the robot has told of.
        camera: Pictures of the robot's camera.
        path: Newest path.
        path_received_s: Time of its arrival, on the console's clock [s].
        plan_id: Id of the newest preview, 0 without one.
        plan_received_s: Time of its arrival, on the console's clock [s].
        stop: Newest stop of this site.
        command_round_trips_s: Round trip of each accepted command [s].
    """

    now_s: float
    robot: Telemetry | None
    robot_version: str
    robot_tasks: tuple[str, ...]
    other_schema: str
    link: LinkView
    in_control: bool
    why_not_in_control: Reason | None
    wish: Wish
    asked_by: str
    pending: dict[Action, Pending]
    notices: tuple[Notice, ...]
    task: AnyTask
    tasks: tuple[TaskStanding, ...]
    sending_library: bool
    recording: bool
    demonstrations: tuple[Demonstration, ...]
    demonstration_names: tuple[str, ...]
    can_undo: bool
    can_recover: bool
    fetching: float | None
    robot_scene: SceneDescription | None
    scene_fetching: float | None
    learned: LearnedModel | None
    forming: TPHSMM | None
    confirmed_sha256: str
    robot_model: LearnedModel | None
    miss: str
    auto_send: bool
    revisions: tuple[Revision, ...]
    revision: int
    strokes: tuple[NDArray[np.float64], ...]
    stroke_frames: tuple[tuple[TaskFrame, ...], ...]
    own_frames: tuple[TaskFrame, ...]
    own_arm: ArmView | None
    executions: Executions
    camera: CameraState
    path: PlannedPath | None
    path_received_s: float
    plan_id: int
    plan_received_s: float
    stop: StopStatus | None
    command_round_trips_s: tuple[float, ...]

    @property
    def standing(self) -> TaskStanding:
        """Standing of the chosen task."""
        return next(each for each in self.tasks if each.name == self.task.name)

    @property
    def sending_model(self) -> bool:
        """True while a model of the task is being sent."""
        return bool(self.standing.sending_sha256)

    @property
    def n_demonstrations(self) -> int:
        """Number of learned demonstrations."""
        return len(self.demonstrations)

    @property
    def mode(self) -> ControlMode | None:
        """Mode that the robot reported; None before its first report."""
        return self.robot.mode if self.robot else None

    @property
    def phase(self) -> Phase:
        """Phase that the robot reported."""
        return self.robot.phase if self.robot else Phase.NONE

    @property
    def at_goal(self) -> bool:
        """True while the operator's own arm stands at the end of the task that is being taught."""
        arm, task = self.own_arm, self.task
        return self.recording and arm is not None and isinstance(task, ArmTask) and arm.is_at_goal(task)

    @property
    def can_move_place(self) -> bool:
        """True if the operator's receptacle, or the frames of the board, can be moved to another place."""
        return self.own_arm is not None or (isinstance(self.task, PointTask) and self.task.varies)

    @property
    def coupled(self) -> bool:
        """True while the operator's hand moves the robot."""
        return self.mode is ControlMode.DIRECT

    @property
    def recorded_s(self) -> float | None:
        """Duration of the recording that the robot is making [s]; None while it makes none."""
        return None if self.robot is None or self.robot.recorded_s is UNSET else self.robot.recorded_s

    @property
    def robot_records(self) -> bool:
        """True while the robot records how it is driven."""
        return self.recorded_s is not None
