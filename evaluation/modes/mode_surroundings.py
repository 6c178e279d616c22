"""Surroundings of the shipped supervisor in the exhaustive check: task, model, clock, plant and sight."""

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
from farhand.remote_site.interface.plant import EffectorState, PointPlant

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
    frames = [TaskFrame(np.eye(2), np.array(_ORIGIN_M))]
    for stroke in sample_strokes(TASK):
        learner.start()
        learner.observe_many(stroke.position_m, frames, stroke.time_s.tolist())
        learner.end()
    content = model_file.encode(learner.model())
    return ModelTransfer(task=TASK.name, sha256=model_file.content_hash(content), content=content)


class Source:
    """Virtual time behind a clock [ns]."""

    def __init__(self, start_s: float):
        self.ns = round(start_s * 1e9)

    def __call__(self) -> int:
        """Return the present time."""
        return self.ns


class FeelingPlant(PointPlant):
    """Point with a force on it that the world sets [N]."""

    force_n = 0.0

    def read(self) -> EffectorState:
        """See `Plant.read`."""
        state = super().read()
        return EffectorState(state.position_m, state.velocity_m_s, np.array([-self.force_n, 0.0]))


class Sight:
    """Perception of a target that stands still, while it is seen."""

    def __init__(self) -> None:
        self.seen, self.offset_m, self.broken = True, 0.0, False

    def observe(self, now_s: float) -> list[TaskFrame] | None:
        """See `Perception.observe`."""
        del now_s
        if not self.seen:
            return None
        x = np.nan if self.broken else _ORIGIN_M[0] + self.offset_m
        return [TaskFrame(np.eye(2), np.array([x, _ORIGIN_M[1]]))]

    def true_origin_m(self, now_s: float) -> None:
        """See `Perception.true_origin_m`."""
        del now_s
