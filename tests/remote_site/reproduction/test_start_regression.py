from __future__ import annotations

import numpy as np

from farhand.common.model.task_frame import TaskFrame
from farhand.local_site.learning.online_learner import LearnerSettings, OnlineLearner
from farhand.remote_site.reproduction.start_regression import given_start
from tests.strategies import learned


def test_a_start_like_those_of_the_demonstrations_moves_little_and_its_own_demonstration_not_at_all():
    model = learned(n_demonstrations=1)
    same = given_start(model, model.start_means[:, 0])
    np.testing.assert_allclose(same.means, model.means, atol=1e-12)
    step = np.array([0.1, 0.0])
    shift = given_start(model, model.start_means[:, 0] + step).means - model.means
    np.testing.assert_allclose(shift[0], (1.0 - model.phase)[:, None] * step, atol=1e-9)
    assert not shift[0, model.terminal].any()


def test_an_unknown_start_changes_nothing():
    model = learned()
    assert given_start(model, None) is model


def test_who_starts_on_the_way_is_expected_to_stay_for_less_time():
    """Two demonstrations of one straight way at one speed; the second begins within the first's component."""
    learner, starts = OnlineLearner(LearnerSettings(0.3), 2, ("goal",)), (1.0, 0.8)
    for x in starts:
        time_s = np.arange(0.0, x, 0.01)
        points = np.stack([x - time_s, np.zeros_like(time_s)], axis=1)
        learner.start()
        learner.observe_many(points, [TaskFrame.identity(2)], time_s)
        learner.end()
    model = learner.model()
    longer, shorter = (given_start(model, np.array([[x, 0.0]])).duration_mean_s[0] for x in starts)
    assert longer > model.duration_mean_s[0] > shorter
