from __future__ import annotations

import numpy as np
import pytest
from numba.core import event

from farhand.common.model.manifold import POSE, Manifold
from farhand.common.model.task_frame import TaskFrame
from farhand.remote_site.reproduction.executor import Executor, ExecutorSettings
from farhand.remote_site.reproduction.warm_up import warm_up
from tests.strategies import learned


@pytest.mark.parametrize("space", [Manifold(2), Manifold(3), POSE])
def test_after_warming_up_no_tick_compiles_anything(space: Manifold):
    warm_up(space)
    model, still = learned(space), np.zeros(space.n_tangent)
    executor, point = Executor(model, ExecutorSettings()), model.start_means[0, 0]
    with event.install_recorder("numba:compile") as compiled:
        executor.begin(point, still, [TaskFrame.identity(space.n_dims)])
        for n in range(200):
            executor.step(point, still, [TaskFrame(np.eye(space.n_dims), np.full(space.n_dims, 1e-3 * n))])
        executor.predict(point, still, [TaskFrame.identity(space.n_dims)], max_points=3)
    assert not compiled.buffer
