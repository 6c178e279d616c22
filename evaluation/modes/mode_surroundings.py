"""Surroundings of the shipped supervisor in the exhaustive check: task, model and target."""

from __future__ import annotations

from functools import cache

import numpy as np

from farhand.common.model import model_file
from farhand.common.model.task_frame import TaskFrame
from farhand.common.task import Limits, PointTask, Sample, Target
from farhand.common.wire.messages import ModelTransfer
from farhand.local_site.learning.online_learner import LearnerSettings, OnlineLearner
from farhand.local_site.teaching.samples import sample_strokes
from farhand.remote_site.config import RemoteConfig

DT_S = 0.05
"""Control period of a slow loop: the rules are about modes, and every tick costs the search time."""
START_M = (0.2, 0.5)
_ORIGIN_M = (0.5, 0.5)

TASK = PointTask(
    name="check",
    n_dims=2,
    frame_names=("goal",),
    workspace_m=(1.0, 1.0),
    start_m=START_M,
    target=Target(origin_m=_ORIGIN_M, amplitude_m=(0.0, 0.0)),
    require_preview=True,
    lost_link="hold",
    retract_m=(-0.1, 0.0),
    samples=(Sample(waypoints_m=(START_M, (0.35, 0.52), _ORIGIN_M), duration_s=1.0),),
    limits=Limits(speed_m_s=0.6, acceleration_m_s2=4.0),
)
CONFIG = RemoteConfig(control_hz=1.0 / DT_S)


@cache
def good_model() -> ModelTransfer:
    """Return an encoded model of the task."""
    learner = OnlineLearner(LearnerSettings(max_distance_m=0.1, min_std_m=0.01), 2, TASK.frame_names)
    frames = [target_frame(0.0)]
    for stroke in sample_strokes(TASK):
        learner.start()
        learner.observe_many(stroke.position_m, frames, stroke.time_s.tolist())
        learner.end()
    content = model_file.encode(learner.model())
    return ModelTransfer(task=TASK.name, sha256=model_file.content_hash(content), content=content)


def target_frame(_now_s: float) -> TaskFrame:
    """Return the frame of the target, which stands still."""
    return TaskFrame(np.eye(2), np.array(_ORIGIN_M))
