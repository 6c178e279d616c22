"""What the operator can be shown at one moment: one immutable value, made by the console alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from msgspec import UNSET
from numpy.typing import NDArray

from farhand.common.control_mode import Action, ControlMode, Phase
from farhand.common.link.link_monitor import LinkView
from farhand.common.model.task_frame import TaskFrame
from farhand.common.model.tphsmm import TPHSMM
from farhand.common.task import AnyTask
from farhand.common.wire.messages import PlannedPath, Telemetry, Wish
from farhand.common.wire.scene_description import SceneDescription
from farhand.local_site.exchange.notices import Notice
from farhand.local_site.exchange.stop_sender import StopStatus
from farhand.local_site.teaching.lesson import LearnedModel
from farhand.local_site.teaching.revisions import Revision
from farhand.local_site.workcell.arm_view import ArmView


@dataclass(frozen=True)
class Pending:
    """An action that was asked for and is not settled.

    Args:
        command_id: Its id.
        since_s: When it was asked, on the console's clock [s].
        accepted_ns: When the robot accepted it, on the robot's clock [ns]; None before its answer.
        leads_to: The mode that the robot said it leads to.
    """

    command_id: str
    since_s: float
    accepted_ns: int | None = None
    leads_to: ControlMode | None = None


@dataclass(frozen=True)
class TaskStanding:
    """How it stands with one of the tasks.

    Args:
        name: Of the task.
        n_demonstrations: Learned ones.
        learned_sha256: Of the model; empty while nothing was taught.
        model_bytes: Its size [B].
        confirmed_sha256: The model that the robot has confirmed last; empty without one.
        sending: Whether one is on its way, or waits for another task's.
        robot_does: Whether the robot does this task, as far as is known.
    """

    name: str
    n_demonstrations: int
    learned_sha256: str
    model_bytes: int
    confirmed_sha256: str
    sending: bool
    robot_does: bool

    @property
    def differs(self) -> bool:
        """Whether something was taught for the robot that it has not confirmed."""
        return self.robot_does and self.learned_sha256 not in ("", self.confirmed_sha256)


@dataclass(frozen=True)
class Picture:
    """All that the console knows.

    Args:
        now_s: When it was made, on the console's clock [s].
        robot: The robot's newest report; None before the first one.
        robot_version: Version of the robot's Farhand, empty while it is not known.
        robot_tasks: Tasks that the robot does, none while they are not known.
        other_schema: Why its messages are not understood, when they are of another version.
        link: The link.
        in_control: Whether this site holds the lease.
        why_not_in_control: The robot's words when it does not.
        wish: What this site wants of the control.
        asked_by: Who asks this site for the control, empty for nobody.
        pending: Actions under way.
        notices: The newest last.
        task: The task that is chosen; what follows is about it.
        tasks: All of them, in their order.
        sending_library: Whether the library is on its way.
        recording: Whether a demonstration is being made.
        n_demonstrations: Learned ones.
        can_undo: Whether there is one to forget.
        can_recover: Whether a demonstration is left over that was recorded here, or by the robot, and not learned.
        fetching: The part of a recording of the robot that is here, from 0 to 1; None while none is on its way.
        robot_scene: What the robot looks like; None while that is not known.
        scene_fetching: The part of it that is here, from 0 to 1; None while it is not on its way.
        learned: The model of all ended demonstrations.
        forming: The model with the demonstration under way, None without one.
        confirmed_sha256: The model that the robot has confirmed last.
        sending_model: Whether one is on its way.
        auto_send: Whether a model is sent whenever it changes.
        revisions: The newest ones of the task, the newest last.
        revision: The one that counts, 0 before the first.
        strokes: What was demonstrated, each of shape (T, C), the one under way last: positions on the board
            [m], or poses from the base of the operator's arm.
        stroke_frames: The task frames that each of them was made in. Each of length P.
        own_frames: The task frames at the operator's place now. Length P.
        own_arm: The operator's arm; None where a hand alone demonstrates.
        path: The newest path.
        path_received_s: When it came, on the console's clock [s].
        plan_id: The newest preview, 0 without one.
        plan_received_s: When it came, on the console's clock [s].
        stop: The newest stop of this site.
        command_round_trips_s: Of each command that was accepted [s].
    """

    now_s: float
    robot: Telemetry | None
    robot_version: str
    robot_tasks: tuple[str, ...]
    other_schema: str
    link: LinkView
    in_control: bool
    why_not_in_control: str
    wish: Wish
    asked_by: str
    pending: dict[Action, Pending]
    notices: tuple[Notice, ...]
    task: AnyTask
    tasks: tuple[TaskStanding, ...]
    sending_library: bool
    recording: bool
    n_demonstrations: int
    can_undo: bool
    can_recover: bool
    fetching: float | None
    robot_scene: SceneDescription | None
    scene_fetching: float | None
    learned: LearnedModel | None
    forming: TPHSMM | None
    confirmed_sha256: str
    sending_model: bool
    auto_send: bool
    revisions: tuple[Revision, ...]
    revision: int
    strokes: tuple[NDArray[np.float64], ...]
    stroke_frames: tuple[tuple[TaskFrame, ...], ...]
    own_frames: tuple[TaskFrame, ...]
    own_arm: ArmView | None
    path: PlannedPath | None
    path_received_s: float
    plan_id: int
    plan_received_s: float
    stop: StopStatus | None
    command_round_trips_s: tuple[float, ...]

    @property
    def standing(self) -> TaskStanding:
        """How it stands with the chosen task."""
        return next(each for each in self.tasks if each.name == self.task.name)

    @property
    def mode(self) -> ControlMode | None:
        """The mode that the robot reported; None before its first report."""
        return self.robot.mode if self.robot else None

    @property
    def phase(self) -> Phase:
        """The phase that the robot reported."""
        return self.robot.phase if self.robot else Phase.NONE

    @property
    def coupled(self) -> bool:
        """Whether the operator's hand moves the robot."""
        return self.mode is ControlMode.DIRECT

    @property
    def recorded_s(self) -> float | None:
        """For how long the robot has been recording how it is driven [s]; None while it does not."""
        return None if self.robot is None or self.robot.recorded_s is UNSET else self.robot.recorded_s

    @property
    def robot_records(self) -> bool:
        """Whether the robot records how it is driven."""
        return self.recorded_s is not None
