"""The planar task and what its own samples teach."""

from __future__ import annotations

import functools
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from msgspec import structs

from farhand.common.configuration import load_toml
from farhand.common.model.model_file import content_hash, encode
from farhand.common.model.task_frame import TaskFrame
from farhand.common.model.tphsmm import TPHSMM
from farhand.common.task import PointTask
from farhand.common.wire.messages import ModelTransfer
from farhand.evaluation.harness.bad_neighbours import cyclic_model
from farhand.local_site.learning.online_learner import LearnerSettings, OnlineLearner
from farhand.local_site.teaching.samples import sample_strokes
from tests.strategies import learned

TASK = load_toml(Path(__file__).parents[2] / "deploy" / "tasks" / "planar.toml", PointTask)


def with_preview() -> PointTask:
    """The planar task, but previewed before it is executed."""
    return structs.replace(TASK, require_preview=True)


@functools.cache
def planar_model() -> TPHSMM:
    """What the task's own samples teach."""
    learner = OnlineLearner(LearnerSettings(0.22, min_std_m=0.01), 2, TASK.frame_names)
    frames = [TaskFrame(np.eye(2), np.array(TASK.target.origin_m))]
    for stroke in sample_strokes(TASK):
        learner.start()
        learner.observe_many(stroke.position_m, frames, stroke.time_s)
        learner.end()
    return learner.model()


def short_strokes() -> TPHSMM:
    """A small model of strokes to the target, which is executed within seconds."""
    return replace(learned(), frame_names=TASK.frame_names)


def transfer(model: TPHSMM | None = None, **changes: Any) -> ModelTransfer:
    """A model on its way, with what is wrong about it."""
    model = model or planar_model()
    if model.n_frames == len(TASK.frame_names):
        model = replace(model, frame_names=TASK.frame_names)
    content = encode(model)
    fields = {"task": TASK.name, "sha256": content_hash(content), "content": content}
    return ModelTransfer(**(fields | changes))


def cyclic(n: int) -> TPHSMM:
    """Components that lead to each other in a circle, each with a way out of it to the last one."""
    return cyclic_model(planar_model(), n)
