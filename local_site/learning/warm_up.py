"""`warm_up`: the kernels of learning are compiled before the first datapoint arrives.

`python -m farhand.local_site.learning.warm_up` compiles them ahead, for the plane and for space.
"""

from __future__ import annotations

import numpy as np

from farhand.common.model.manifold import POSE, Manifold
from farhand.common.model.task_frame import TaskFrame
from farhand.local_site.learning.learner_settings import LearnerSettings
from farhand.local_site.learning.online_learner import OnlineLearner


def warm_up(space: Manifold | int, n_frames: int = 1) -> None:
    """Learn a short motion in a space of `Manifold` or dimension D, and forget it.

    Args:
        space: Of the datapoints to come.
        n_frames: Number of task frames P.
    """
    names = [f"frame {j}" for j in range(n_frames)]
    learner = OnlineLearner(LearnerSettings(1.0), space, names)
    points = np.zeros((3, learner.space.n_coordinates))
    points[:, 0] = [0.0, 1.0, 2.0]
    points[:, learner.space.n_dims : learner.space.n_dims + 1] = 1.0  # the quaternion's real part
    frames = [TaskFrame.at(points[0])] * n_frames
    frames[0].to_world(frames[0].to_local(points))
    learner.start()
    learner.observe_many(points[:2], frames, [0.0, 1.0])
    learner.observe(points[2], frames, 2.0)
    learner.end()
    learner.model()


if __name__ == "__main__":
    for each in (2, POSE):
        warm_up(each)
