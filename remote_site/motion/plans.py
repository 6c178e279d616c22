"""Previews and committed paths: their requests, and the validity of a preview.

A preview is valid while robot, target and model are those that it was made with. A newer preview replaces an
older one that is still pending.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from farhand.common.model.task_frame import TaskFrame
from farhand.common.wire.messages import Command, PlannedPath, Stamp
from farhand.common.wire.reasons import Code, Reason, because
from farhand.remote_site.interface.embodiment import Embodiment
from farhand.remote_site.interface.sensing import Sensing, apart
from farhand.remote_site.motion.execution import Execution
from farhand.remote_site.motion.model_trial import StoredModel
from farhand.remote_site.motion.preview_worker import PlanRequest

Array = NDArray[np.float64]

_MAX_EFFECTOR_MOVE_M, _MAX_EFFECTOR_TURN_RAD = 0.010, math.radians(3.0)
_MAX_FRAME_MOVE_M, _MAX_FRAME_TURN_RAD = 0.050, math.radians(5.0)
_MAX_AGE_S = 60.0
_KEPT = 16
_REPLAN_S = 1.0
_REPLAN_FRAME_M = 0.005


@dataclass(frozen=True)
class PreviewConditions:
    """Conditions on which a plan depends.

    Args:
        effector: Frame of the effector.
        mean_frames: The task frames, each averaged over its movement.
        model_sha256: SHA-256 of the model.
        time_s: Time on the robot's clock [s].
    """

    effector: TaskFrame
    mean_frames: list[TaskFrame]
    model_sha256: str
    time_s: float


class Plans:
    """Last previews by their id, and the committed path of the execution.

    Args:
        sensing: Newest measurements.
        embodiment: The robot: settings and examination of its executions.
        submit: Hands a request to the worker; never blocks.
    """

    def __init__(self, sensing: Sensing, embodiment: Embodiment, submit: Callable[[PlanRequest], None]):
        self._sensing, self._skill, self._submit = sensing, embodiment.skill, submit
        self.settings = embodiment.hardware.settings
        """Settings of the next execution, and of its previews."""
        self._previews: dict[int, PreviewConditions] = {}
        self._plan_count = 0
        self._path_count = 0
        self._committed_s = -np.inf
        self._committed_frame_m: Array | None = None

    def preview(self, stored: StoredModel, now: Stamp) -> int:
        """Request a rollout of the whole task from here. Return the plan's id."""
        self._plan_count += 1
        self._request(stored, None, self._plan_count, now)
        return self._plan_count

    def commit(self, execution: Execution, now: Stamp) -> None:
        """Request a rollout of the rest of an execution: at most once a second, and only if a frame has moved."""
        now_s, origin = now.t_ns * 1e-9, np.concatenate([frame.b for frame in self._sensing.frames])
        moved = self._committed_frame_m is None or (
            float(np.linalg.norm(origin - self._committed_frame_m)) > _REPLAN_FRAME_M
        )
        if moved and now_s - self._committed_s >= _REPLAN_S:
            self._committed_s, self._committed_frame_m = now_s, origin
            self._request(execution.stored, execution, 0, now)

    def forget_commit(self) -> None:
        """Make the first path of a new execution due at once."""
        self._committed_s, self._committed_frame_m = -np.inf, None

    def situation(self, model_sha256: str, now: Stamp) -> PreviewConditions:
        """Return the conditions of a plan made now."""
        effector = TaskFrame.at(self._sensing.effector.point)
        return PreviewConditions(effector, self._sensing.mean_frames(), model_sha256, now.t_ns * 1e-9)

    def shown(self, request: PlanRequest) -> None:
        """Register a preview that is being sent to the operator: it can be executed from now on."""
        effector = TaskFrame.at(request.effector.point)
        self._previews[request.plan_id] = PreviewConditions(
            effector, self._sensing.mean_frames(), request.stored.sha256, request.stamp.t_ns * 1e-9
        )
        if len(self._previews) > _KEPT:
            del self._previews[min(self._previews)]

    def refusal(self, plan_id: int, now: PreviewConditions, round_trip_s: float) -> Reason | None:
        """Return the reason why a plan is no longer valid, with the measured difference; None while it is valid."""
        plan = self._previews.get(plan_id)
        if plan is None:
            return because(Code.NO_SUCH_PLAN, plan=str(plan_id))
        if plan.model_sha256 != now.model_sha256:
            return because(Code.OTHER_MODEL_PREVIEWED)
        for what, before, at, most_m, most_rad in (
            ("robot", plan.effector, now.effector, _MAX_EFFECTOR_MOVE_M, _MAX_EFFECTOR_TURN_RAD),
            *(
                ("target", *frames, _MAX_FRAME_MOVE_M, _MAX_FRAME_TURN_RAD)
                for frames in zip(plan.mean_frames, now.mean_frames, strict=True)
            ),
        ):
            moved_m, turned_rad = apart(before, at)
            if moved_m > most_m:
                return because(Code.MOVED_SINCE, moved_m=moved_m, what=what)
            if turned_rad > most_rad:
                return because(Code.TURNED_SINCE, turned_rad=turned_rad, what=what)
        age_s = now.time_s - plan.time_s
        if age_s > _MAX_AGE_S + round_trip_s:
            return because(Code.PREVIEW_TOO_OLD, age_s=age_s)
        return None

    def _request(self, stored: StoredModel, execution: Execution | None, plan_id: int, now: Stamp) -> None:
        self._path_count += 1
        state = execution.executor.state() if execution is not None else None
        settings = execution.settings if execution is not None else self.settings
        self._submit(
            PlanRequest(
                path_id=self._path_count,
                plan_id=plan_id,
                stamp=now,
                stored=stored,
                settings=settings,
                state=state,
                effector=self._sensing.effector,
                frames=tuple(self._sensing.frames),
                check=self._skill.check(stored.task, self._sensing) if plan_id else None,
            )
        )


class Previews:
    """Register of the one preview that may wait for its plan.

    Args:
        plans: Makes and keeps the plans.
    """

    def __init__(self, plans: Plans):
        self._plans = plans
        self._plan_id = 0
        self._command: Command | None = None

    def begin(self, command: Command, stored: StoredModel, now: Stamp) -> Command | None:
        """Request a plan for a command. Return the command that it replaces, if one was waiting."""
        replaced = self._command
        self._plan_id, self._command = self._plans.preview(stored, now), command
        return replaced

    def finish(self, request: PlanRequest, path: PlannedPath | None) -> Command | None:
        """Finish a plan that was made, or failed. Return the command that waits for it, if any."""
        if self._command is None or request.plan_id != self._plan_id:
            return None
        command, self._command = self._command, None
        if path is not None:
            self._plans.shown(request)
        return command
