from __future__ import annotations

import numpy as np
import pytest
from numba.core import event

from farhand.common.model.manifold import POSE, Manifold
from farhand.common.model.task_frame import TaskFrame
from farhand.local_site.learning.online_learner import LearnerSettings, OnlineLearner
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
