from __future__ import annotations

import numpy as np
import pytest
from numba.core import event

from farhand.common.model.manifold import POSE, Manifold
from farhand.common.model.task_frame import TaskFrame
from farhand.local_site.learning.online_learner import LearnerSettings, OnlineLearner
from farhand.local_site.learning.stream import learn_points
from farhand.local_site.learning.warm_up import warm_up


@pytest.mark.parametrize("space", [Manifold(2), Manifold(3), POSE])
def test_after_warming_up_nothing_is_compiled_any_more(space: Manifold):
    warm_up(space)
    learner = OnlineLearner(LearnerSettings(0.3), space)
    points = np.zeros((5, space.n_coordinates))
    points[:, 0] = np.arange(5.0)
    points[:, space.n_dims : space.n_dims + 1] = 1.0
    with event.install_recorder("numba:compile") as compiled:
        learner.start()
        for time_s, point in enumerate(points):
            learner.observe(point, [TaskFrame.identity(space.n_dims)], float(time_s))
        learner.end()
    assert not compiled.buffer


def test_how_an_array_lies_in_memory_compiles_nothing():
    """Arrays of files are read-only, columns are strided, and each kind would have all kernels compiled once more."""
    warm_up(POSE)
    points = np.zeros((5, 7))
    points[:, 0], points[:, 3] = np.arange(5.0), 1.0
    times_s = np.arange(5.0)
    table = np.column_stack([times_s, points])
    for array in (points, times_s):
        array.setflags(write=False)
    kinds = [(points, times_s), (table[:, 1:], table[:, 0]), (np.asfortranarray(points), times_s[::-1][::-1])]
    frame = TaskFrame.at(points[0])
    for kind, times in kinds:
        for in_frames in (False, True):
            learner = OnlineLearner(LearnerSettings(0.3), POSE)
            learner.start()
            if in_frames:
                learner.observe_in_frames(frame.to_local(kind)[:, None], times)
            else:
                learner.observe_many(kind, [frame], times)
            learner.end()
    assert len(learn_points.signatures) == 1
