"""`farhand rollout`: reproduce a demonstration with a model, in the demonstration's own frames."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from farhand.common.errors import InvalidDemonstration
from farhand.common.model.task_frame import TaskFrame
from farhand.common.model.tphsmm import TPHSMM
from farhand.local_site.teaching.demonstration import Demonstration
from farhand.remote_site.reproduction import point_rollout
from farhand.remote_site.reproduction.executor import ExecutorSettings


def roll_out(
    model: TPHSMM, demonstration: Demonstration, settings: ExecutorSettings | None = None
) -> Demonstration:
    """Execute the model as `reproduce` does; what comes of an execution that gave up is returned too."""
    return reproduce(model, demonstration, settings)[0]


def reproduce(
    model: TPHSMM, demonstration: Demonstration, settings: ExecutorSettings | None = None
) -> tuple[Demonstration, bool]:
    """Execute the model on the point plant from the demonstration's start, in its frames.

    Returns:
        The motion, and whether it came to its end; if not, it was given up.

    Raises:
        InvalidDemonstration: When its dimension or frames are not the model's.
        InvalidModel: When the model's motion takes longer than anybody demonstrates.
    """
    if demonstration.n_dims != model.n_dims or demonstration.frame_names != model.frame_names:
        expected = f"dimension {model.n_dims} and frames {model.frame_names}, as the model has"
        raise InvalidDemonstration("demonstration", "position_m, frame_names", expected)
    if model.manifold.oriented and not demonstration.space.oriented:
        raise InvalidDemonstration("demonstration", "quat_wxyz", "orientations, as the model has")
    clock = demonstration.time_s - demonstration.time_s[0]
    fixed = None if demonstration.frames_move else demonstration.frames_at(0)

    def sample_at(time_s: float) -> int:
        return int(np.searchsorted(clock, time_s, side="right")) - 1

    def frames_at(time_s: float) -> list[TaskFrame]:
        return fixed or demonstration.frames_at(sample_at(time_s))

    start = demonstration.points[0, : model.manifold.n_coordinates]
    result = point_rollout.roll_out(model, start, frames_at, settings)
    samples = [sample_at(t) for t in result.time_s]
    moving_b, moving_A = demonstration.frame_origin_m.ndim == 3, demonstration.frame_rotation.ndim == 4
    motion = replace(
        demonstration,
        time_s=result.time_s,
        position_m=result.position_m,
        frame_origin_m=demonstration.frame_origin_m[samples] if moving_b else demonstration.frame_origin_m,
        frame_rotation=demonstration.frame_rotation[samples] if moving_A else demonstration.frame_rotation,
        quat_wxyz=result.quat_wxyz,
        source=f"rollout of a model{'' if result.arrived else ' (gave up before its end)'}",
    )
    return motion, result.arrived
