from __future__ import annotations

import numpy as np
import pytest

from farhand.remote_site.reproduction.executor import ExecutorSettings
from farhand.remote_site.reproduction.point_rollout import roll_out
from tests.remote_site.reproduction.scenes import STARTS, descents, still


def test_a_rollout_begins_at_rest_at_the_start_and_ends_at_the_goal():
    result = roll_out(descents(), np.array(STARTS[0]), lambda t: still())
    assert result.arrived
    np.testing.assert_array_equal(result.position_m[0], STARTS[0])
    assert np.linalg.norm(result.position_m[-1]) < 0.006
    assert len(result.time_s) == len(result.position_m) == len(result.components)
    np.testing.assert_allclose(np.diff(result.time_s), 0.02, atol=1e-12)
    assert 3.0 < result.time_s[-1] < 6.0


def test_a_rollout_that_cannot_arrive_is_given_up():
    crawling = ExecutorSettings(max_speed_m_s=0.001)
    result = roll_out(descents(), np.array(STARTS[0]), lambda t: still(), crawling)
    assert not result.arrived
    assert result.time_s[-1] == pytest.approx(3.0 * 4.0 + 5.0, abs=1.0)


def test_a_rollout_follows_frames_that_move():
    result = roll_out(descents(), np.array(STARTS[1]), lambda t: still(np.array([0.05 * t, 0.0])))
    assert result.arrived
    goal = np.array([0.05 * result.time_s[-1], 0.0])
    assert np.linalg.norm(result.position_m[-1] - goal) < 0.01
