"""Previews: rollouts of the whole remaining task, computed in a worker; the control loop never waits for one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from farhand.common.event_loop import Mailbox, Worker
from farhand.common.log import loop_logger
from farhand.common.model.task_frame import TaskFrame
from farhand.common.model.way import distance_from_taught
from farhand.common.wire.messages import PlannedPath, Stamp
from farhand.common.wire.motion_encoding import packed
from farhand.common.wire.reasons import Code, Reason, because
from farhand.remote_site.interface.embodiment import Check
from farhand.remote_site.interface.plant import EffectorState
from farhand.remote_site.motion.model_trial import StoredModel
from farhand.remote_site.reproduction.executor import Executor, ExecutorSettings, ExecutorState

_log = loop_logger(__name__)

STEP_S = 0.1
MAX_POINTS = 200


@dataclass(frozen=True)
class PlanRequest:
    """Request for a rollout, copied from the control loop at one instant.

    Args:
        path_id: Id of the result.
        plan_id: Id of the plan when an operator asked for it.
        stamp: The instant.
        stored: The model.
        settings: Settings of the execution.
        state: Progress of the execution so far; None to plan from the beginning.
        effector: State of the robot.
        frames: Task frames at the instant.
        check: Examines the motion before it is planned; None for no examination.
    """

    path_id: int
    plan_id: int
    stamp: Stamp
    stored: StoredModel
    settings: ExecutorSettings
    state: ExecutorState | None
    effector: EffectorState
    frames: tuple[TaskFrame, ...]
    check: Callable[[], Check] | None = None


def plan(request: PlanRequest) -> PlannedPath:
    """Roll the model out from the request's instant to its end."""
    (at, moving), frames = request.effector.controlled, request.frames
    if request.state is None:
        executor = Executor(request.stored.model, request.settings)
        executor.begin(at, moving, frames)
    else:
        executor = Executor.from_state(request.stored.model, request.settings, request.state)
    path = executor.predict(at, moving, frames, step_s=STEP_S, max_points=MAX_POINTS)
    away, away_frame, model = 0.0, 0, request.stored.model
    if request.plan_id:
        away, away_frame = distance_from_taught(model.ways, at, frames, model.max_distance_m)
    return PlannedPath(
        path_id=request.path_id,
        plan_id=request.plan_id,
        stamp=request.stamp,
        model_sha256=request.stored.sha256,
        n_coordinates=at.size,
        step_s=path.step_s,
        points=packed(path.points_local),
        reaches_end=path.done,
        away=min(away, 1e6),
        away_frame=away_frame,
    )


def answer(request: PlanRequest) -> tuple[PlannedPath | None, Reason | None]:
    """Return the path with a warning for the operator, or None with the reason why there is none."""
    found = Check() if request.check is None else request.check()
    return (plan(request), found.warning) if found.refusal is None else (None, found.refusal)


class PreviewWorker(Worker[PlanRequest]):
    """Worker; of several waiting requests it serves only the newest preview and the newest commit.

    Args:
        deliver: Called in the worker with each request and the result of `answer`.
    """

    def __init__(self, deliver: Callable[[PlanRequest, PlannedPath | None, Reason | None], None]):
        self._deliver = deliver
        super().__init__("planner", self._answer, Mailbox(), Mailbox())

    def request(self, request: PlanRequest) -> None:
        """Request a rollout. Never blocks."""
        self.submit(request, box=0 if request.plan_id else 1)

    def _answer(self, request: PlanRequest) -> None:
        try:
            path, note = answer(request)
        except Exception as error:  # a plan that fails must not end the worker
            _log.exception("the planning of path %d failed", request.path_id)
            self._deliver(request, None, because(Code.PLAN_FAILED, text=str(error)))
        else:
            self._deliver(request, path, note)
