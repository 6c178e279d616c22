"""Which way an execution takes, and how it carries it out."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from farhand.common.model.manifold import POSE, Manifold
from farhand.common.model.model_file import decode, encode
from farhand.common.model.task_frame import TaskFrame
from farhand.common.model.tphsmm import TPHSMM
from farhand.local_site.learning.online_learner import LearnerSettings, OnlineLearner
from farhand.remote_site.reproduction.chains import chosen, with_way
from farhand.remote_site.reproduction.executor import Executor, ExecutorSettings
from farhand.remote_site.reproduction.point_rollout import roll_out
from tests.strategies import learned

HERE, LAMBDA_M = [TaskFrame.identity(2)], 0.1


def arc(start: NDArray, side: float, n: int = 150) -> NDArray:
    """From a start to the origin, by a bend to one side."""
    s = np.linspace(0.0, 1.0, n)[:, None]
    s = s**3 * (10 - 15 * s + 6 * s**2)
    return (1 - s) * start + s * (1 - s) * np.array([0.0, side])


def taught(sides: tuple[float, ...], seed: int = 0) -> TPHSMM:
    random, learner = np.random.default_rng(seed), OnlineLearner(LearnerSettings(LAMBDA_M), 2)
    for side in sides:
        learner.start()
        points = arc(np.array([0.8, 0.0]) + random.uniform(-0.1, 0.1, 2), side)
        learner.observe_many(points, HERE, 0.02 * np.arange(150.0))
        learner.end()
    return learner.model()


def test_a_way_is_carried_out_as_a_chain_that_ends_where_its_demonstrations_did():
    model = taught((0.6, 0.6, 0.6))
    start, (way,) = np.array([[0.85, 0.05]]), model.ways
    extended = with_way(model, way, start)
    q, passed = model.n_components, []
    while q >= model.n_components:
        passed.append(q)
        q = int(np.argmax(extended.transition[q]))
    assert passed == list(range(model.n_components, extended.n_components))
    assert model.terminal[q]
    assert np.isclose(extended.duration_mean_s[model.n_components :].sum(), way.times_s(start)[-1])
    done = roll_out(model, start[0], lambda t: HERE)
    wanted = arc(start[0], 0.6)
    apart = [np.linalg.norm(done.position_m - x, axis=1).min() for x in wanted]
    assert done.arrived
    assert max(apart) < 0.01


def test_of_two_ways_the_start_decides_and_neither_is_mixed():
    """One way begins on the left, the other on the right; each goes round its own side."""
    random, learner = np.random.default_rng(1), OnlineLearner(LearnerSettings(LAMBDA_M), 2)
    for side in (1.0, -1.0) * 3:
        learner.start()
        start = np.array([0.8, 0.25 * side]) + random.uniform(-0.05, 0.05, 2)
        learner.observe_many(arc(start, 1.2 * side), HERE, 0.02 * np.arange(150.0))
        learner.end()
    model = learner.model()
    assert len(model.ways) == 2
    for side in (1.0, -1.0):
        start = np.array([0.8, 0.25 * side])
        done = roll_out(model, start, lambda t: HERE)
        assert (done.position_m[:, 1] * side > -0.02).all()
        assert (done.position_m[:, 1] * side).max() > 0.3


def test_a_far_start_joins_the_learned_components():
    model = taught((0.6,))
    far = np.array([0.4, -0.6])
    assert chosen(model, far[None]) == -1
    executor = Executor(model, ExecutorSettings())
    executor.begin(far, np.zeros(2), HERE)
    assert executor.way == -1
    assert executor.step(far, np.zeros(2), HERE).component >= 0


def test_on_a_way_no_component_is_named_and_a_continued_execution_is_on_the_same():
    model, start = taught((0.6, 0.6, 0.6)), np.array([0.8, 0.0])
    executor = Executor(model, ExecutorSettings())
    executor.begin(start, np.zeros(2), HERE)
    control = executor.step(start, np.zeros(2), HERE)
    assert (control.component, control.way) == (-1, 0)
    other = Executor.from_state(model, ExecutorSettings(), executor.state())
    mine, theirs = (e.step(start, np.zeros(2), HERE) for e in (executor, other))
    np.testing.assert_array_equal(mine.acceleration, theirs.acceleration)


def test_a_robot_that_leaves_its_way_joins_the_learned_components():
    model, p, v = taught((0.6, 0.6, 0.6)), np.array([0.8, 0.0]), np.zeros(2)
    executor, dt = Executor(model, ExecutorSettings()), 0.02
    executor.begin(p, v, HERE)
    for tick in range(1000):
        if tick == 60:
            p = p + np.array([0.0, -0.4])
        control = executor.step(p, v, HERE)
        if tick == 61:
            assert control.component >= 0
        p, v = p + dt * v + 0.5 * dt**2 * control.acceleration, v + dt * control.acceleration
        if control.arrived:
            break
    else:
        pytest.fail("it never arrived")
    np.testing.assert_allclose(p, 0.0, atol=0.005)


def test_a_robot_that_stands_on_its_way_again_goes_on_from_there():
    """As after a retreat from a receptacle that has jumped: it needs no second approach."""
    model, p, v = taught((0.6, 0.6, 0.6)), np.array([0.8, 0.0]), np.zeros(2)
    executor, dt = Executor(model, ExecutorSettings()), 0.02
    executor.begin(p, v, HERE)
    half_way, whole_s = arc(p, 0.6)[75], executor.remaining_s
    while executor.remaining_s > 0.1 * whole_s:
        control = executor.step(p, v, HERE)
        p, v = p + dt * v + 0.5 * dt**2 * control.acceleration, v + dt * control.acceleration
    executor.step(half_way, np.zeros(2), HERE)
    assert executor.state().progress.component >= model.n_components
    assert 0.4 * whole_s < executor.remaining_s < 0.6 * whole_s


@pytest.mark.parametrize("space", [Manifold(2), Manifold(3), POSE])
def test_a_way_survives_its_bytes_which_are_the_same_again(space: Manifold):
    model = learned(space, n_frames=2)
    data = encode(model)
    kept = decode(data)
    assert encode(kept) == data
    assert len(kept.ways) == len(model.ways) > 0
    for mine, theirs in zip(model.ways, kept.ways, strict=True):
        assert np.abs(mine.points - theirs.points).max() < 1e-4
        assert np.abs(mine.gains - theirs.gains).max() < 1e-3
        assert np.abs(mine.covariances / theirs.covariances.max() - theirs.covariances / theirs.covariances.max()).max() < 2e-3  # fmt: skip
        assert (mine.n_demonstrations, mine.terminal) == (theirs.n_demonstrations, theirs.terminal)
