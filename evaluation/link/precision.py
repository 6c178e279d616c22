"""Executions with a model as it was learned, in double precision, and as it arrives, rounded to single."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from farhand.common.model.model_file import decode, encode
from farhand.common.model.task_frame import TaskFrame
from farhand.common.model.tphsmm import ARRAY_FIELDS, TPHSMM
from farhand.deploy.places import find_point_task
from farhand.evaluation.metrics.motion_metrics import rms
from farhand.evaluation.paper.approach_trials import scene, taught
from farhand.evaluation.paper.closed_loop import execute
from farhand.evaluation.paper.planar import OscillatingU
from farhand.local_site.learning.online_learner import LearnerSettings, OnlineLearner
from farhand.local_site.teaching.samples import sample_strokes

Array = NDArray[np.float64]
Case = dict[str, Any]
Measure = Callable[[TPHSMM], dict[str, float]]

KINDS = ("planar", "poses")
_AFTER_S = 10.0


def compare(kind: str, seed: int) -> Case:
    """Errors of both, and what each takes as bytes."""
    model, measure = _planar(seed) if kind == "planar" else _poses(seed)
    content = encode(model)
    return {
        "double": measure(model),
        "single": measure(decode(content)),
        "double_bytes": sum(getattr(model, name).nbytes for name in ARRAY_FIELDS),
        "single_bytes": len(content),
    }


def _planar(seed: int) -> tuple[TPHSMM, Measure]:
    """A model of the task's strokes, and how far from the U an execution of it stays."""
    task = find_point_task("planar")
    strokes = sample_strokes(task, seed)
    settings = LearnerSettings(task.learning.max_distance_m or 0.22, task.learning.min_std_m)
    learner = OnlineLearner(settings, 2, task.frame_names)
    at = [TaskFrame(np.eye(2), np.array(task.target.origin_m))]
    for stroke in strokes:
        learner.start()
        learner.observe_many(stroke.position_m, at, stroke.time_s.tolist())
        learner.end()

    def measure(model: TPHSMM) -> dict[str, float]:
        event = OscillatingU(task, seed)
        done = execute(model, strokes[seed % len(strokes)].position_m[0], event, rest_s=_AFTER_S)
        after = done.time_s > done.time_s[-1] - _AFTER_S
        return {"after the arrival [mm]": 1e3 * rms(done.world[after] - event.truth(done.time_s[after]))}

    return learner.model(), measure


def _poses(seed: int) -> tuple[TPHSMM, Measure]:
    """A model of the synthetic approach, and where an execution of it ends."""

    def measure(model: TPHSMM) -> dict[str, float]:
        event, _, start = scene(seed, "static", oriented=True)
        done = execute(model, start, event, rest_s=1.0)
        end_mm = 1e3 * float(np.linalg.norm(done.local[-1]))
        return {"at the mouth [mm]": end_mm, "turn [deg]": float(done.turn_deg[-1])}

    return taught(seed, oriented=True)[1], measure
