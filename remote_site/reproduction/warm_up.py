"""`warm_up`: compiles the kernels of the control loop before the first tick is due.

`python -m farhand.remote_site.reproduction.warm_up` compiles them ahead, for the plane and for space.
"""

from __future__ import annotations

import numpy as np

from farhand.common.model.manifold import POSE, Manifold
from farhand.common.model.task_frame import TaskFrame
from farhand.common.model.tphsmm import TPHSMM
from farhand.remote_site.reproduction.executor import Executor, ExecutorSettings


def warm_up(space: Manifold | int) -> None:
    """Execute a few periods of a model of two components in a space of `Manifold` or dimension D."""
    space = space if isinstance(space, Manifold) else Manifold(space)
    model = _two_components(space)
    executor, here = Executor(model, ExecutorSettings()), model.means[0, 0]
    frames = [TaskFrame.at(here)]
    frames[0].to_world(frames[0].to_local(here))
    executor.begin(here, np.zeros(space.n_tangent), frames)
    executor.step(here, np.zeros(space.n_tangent), frames)
    executor.predict(here, np.zeros(space.n_tangent), frames, max_points=2)


def _two_components(space: Manifold) -> TPHSMM:
    K, T = 2, space.n_tangent
    means = np.zeros((1, K, space.n_coordinates))
    means[..., space.n_dims : space.n_dims + 1] = 1.0  # the quaternion's real part
    eye, zeros = np.broadcast_to(np.eye(T), (1, K, T, T)), np.zeros((1, K, T))
    return TPHSMM(
        frame_names=("goal",),
        max_distance_m=1.0,
        n_demonstrations=1,
        initial=np.array([1.0, 0.0]),
        transition=np.array([[0.0, 1.0], [0.0, 0.0]]),
        time_share=np.array([[0.0, 1.0], [0.0, 0.0]]),
        exit=np.array([0.0, 1.0]),
        means=means,
        covariances=eye,
        duration_mean_s=np.ones(K),
        duration_variance_s2=np.ones(K),
        terminal=np.array([False, True]),
        counts=np.ones(K, np.int64),
        phase=np.array([0.0, 1.0]),
        elapsed_mean_s=np.zeros(K),
        slopes=zeros,
        residual_covariances=eye,
        start_means=means,
        start_covariances=eye,
    )


if __name__ == "__main__":
    for each in (2, POSE):
        warm_up(each)
