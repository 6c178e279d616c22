"""Previews: rollouts of the whole remaining task, computed in a worker; the control loop never waits for one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from farhand.common.event_loop import Mailbox, Worker
from farhand.common.log import loop_logger
from farhand.common.model.task_frame import TaskFrame
from farhand.common.model.way import distance_from_taught
from farhand.common.wire.messages import PlannedPath, Stamp
from farhand.common.wire.motion_encoding import packed
from farhand.common.wire.reasons import Code, Reason, because
from farhand.remote_site.interface.embodiment import Check, ExaminePath
from farhand.remote_site.interface.plant import EffectorState
from farhand.remote_site.motion.model_trial import StoredModel
from farhand.remote_site.reproduction.executor import Executor, ExecutorSettings, ExecutorState, Path

Array = NDArray[np.float64]

_log = loop_logger(__name__)

STEP_S = 0.1
MAX_POINTS = 200

_OPEN_RAD, _ASIDE_RAD = np.radians(160.0), np.radians(25.0)
"""Rotation to a component above which noise of the sight decides which way round the tool turns, and how far the start is turned to choose a way."""


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
        check: Examines the planned motion; None for no examination.
    """

    path_id: int
    plan_id: int
    stamp: Stamp
    stored: StoredModel
    settings: ExecutorSettings
    state: ExecutorState | None
    effector: EffectorState
    frames: tuple[TaskFrame, ...]
    check: ExaminePath | None = None


def plan(request: PlanRequest) -> PlannedPath:
    """Roll the model out from the request's instant to its end."""
    return _planned(request, _rolled_out(request, request.effector.controlled[0]))


def _rolled_out(request: PlanRequest, at: Array) -> Path:
    moving, frames = request.effector.controlled[1], request.frames
    if request.state is None:
        executor = Executor(request.stored.model, request.settings)
        executor.begin(at, moving, frames)
    else:
        executor = Executor.from_state(request.stored.model, request.settings, request.state)
    return executor.predict(at, moving, frames, step_s=STEP_S, max_points=MAX_POINTS)


def _planned(request: PlanRequest, path: Path) -> PlannedPath:
    at, model = request.effector.controlled[0], request.stored.model
    away, away_frame = 0.0, 0
    if request.plan_id:
        away, away_frame = distance_from_taught(model.ways, at, request.frames, model.max_distance_m)
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
    path = _rolled_out(request, request.effector.controlled[0])
    found = Check() if request.check is None else _examined(request, request.check, path)
    return (_planned(request, path), found.warning) if found.refusal is None else (None, found.refusal)


def _examined(request: PlanRequest, examine: ExaminePath, path: Path) -> Check:
    """Examine a plan, and both ways round if the execution may turn the tool either way."""
    found, at = examine(path), request.effector.controlled[0]
    turn = _furthest_turn(request, at)
    turned_rad = float(np.linalg.norm(turn))
    if found.refusal is not None or turned_rad < _OPEN_RAD:
        return found
    manifold = request.stored.model.manifold
    for aside_rad in (-_ASIDE_RAD, _ASIDE_RAD):
        start = manifold.exp(at, np.concatenate([np.zeros(3), aside_rad / turned_rad * turn]))
        either = examine(_rolled_out(request, start))
        if either.refusal is not None:
            return either
    return found._replace(warning=found.warning or because(Code.EITHER_WAY, turned_rad=turned_rad))


def _furthest_turn(request: PlanRequest, at: Array) -> Array:
    """Return the largest rotation from a pose to a component's mean, in the goal's frame; zero for positions. Shape (3,)."""
    model = request.stored.model
    if not model.manifold.oriented:
        return np.zeros(3)
    turns = model.manifold.log(request.frames[-1].to_local(at), model.means[-1])[:, 3:]
    return turns[np.argmax(np.linalg.norm(turns, axis=1))]


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
