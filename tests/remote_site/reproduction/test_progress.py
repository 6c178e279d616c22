from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from numpy.typing import NDArray

from farhand.common.errors import InvalidModel
from farhand.common.model.task_frame import TaskFrame
from farhand.common.model.tphsmm import TPHSMM
from farhand.local_site.learning.online_learner import LearnerSettings, OnlineLearner
from farhand.remote_site.reproduction.chains import successors
from farhand.remote_site.reproduction.gaussians import Gaussians
from farhand.remote_site.reproduction.progress import Progress, ProgressTracker
from farhand.remote_site.reproduction.world_components import LocalComponents
from tests.strategies import learned, seeds

DT = 0.02


def gaussians(model: TPHSMM) -> Gaussians:
    return Gaussians.of(model.means[0], model.covariances[0])


def straight() -> TPHSMM:
    """A line of components from x = 1 to the end at 0."""
    learner = OnlineLearner(LearnerSettings(0.1, direction_weight=0.0, distance_weight=0.0), 2)
    for _ in range(2):
        learner.start()
        points = np.linspace([1.0, 0.0], [0.0, 0.0], 200)
        learner.observe_many(points, [TaskFrame.identity(2)], (DT * np.arange(200.0)).tolist())
        learner.end()
    return learner.model()


def chain_from(following: NDArray, first: int) -> list[int]:
    chain = [first]
    while following[chain[-1]] >= 0:
        chain.append(int(following[chain[-1]]))
        assert len(chain) <= len(following), "the chain came back"
    return chain


@settings(deadline=None, derandomize=True, max_examples=20)
@given(seed=seeds)
def test_every_component_leads_to_an_end_without_coming_back(seed: int):
    model = learned(seed=seed, n_demonstrations=4)
    for start in (None, model.start_means[:, 0]):
        following = successors(model, start)
        for i in range(model.n_components):
            chain = chain_from(following, i)
            assert model.terminal[chain[-1]]
            assert all(model.transition[a, b] > 0 for a, b in itertools.pairwise(chain))


def test_of_two_ways_on_the_one_of_those_who_stayed_is_taken():
    model = straight()
    first, second, third = (int(i) for i in np.argsort(model.phase)[:3])
    transition, time_share = model.transition.copy(), model.time_share.copy()
    transition[first, [second, third]] = 0.6, 0.4
    time_share[first, [second, third]] = 0.1, 0.9
    forked = replace(model, transition=transition, time_share=time_share)
    assert successors(forked)[first] == third


def test_a_loop_in_the_counts_does_not_trap_the_motion():
    model = straight()
    K, terminal = model.n_components, int(np.flatnonzero(model.terminal)[0])
    back = np.zeros((K, K))
    order = [i for i in np.argsort(model.phase) if i != terminal]
    for a, b in zip(order, [*order[1:], terminal], strict=True):
        back[a, b] = 0.4
    back[order[-1], terminal], back[order[-1], order[0]] = 0.1, 0.9
    for a in order[:-1]:
        back[a, order[-1]] += 0.6 if back[a, order[-1]] == 0 else 0.0
    back[order[:-1]] /= back[order[:-1]].sum(axis=1, keepdims=True)
    looped = replace(model, transition=back, exit=(np.arange(K) == terminal).astype(float))
    for i in range(K):
        assert model.terminal[chain_from(successors(looped), i)[-1]]
    # the same when phases say nothing
    for i in range(K):
        assert model.terminal[chain_from(successors(replace(looped, phase=np.zeros(K))), i)[-1]]


def test_the_start_decides_between_branches_that_share_a_component():
    learner = OnlineLearner(LearnerSettings(0.15, direction_weight=0.0, distance_weight=0.0), 2)
    for side in (1.0, -1.0):  # two motions that meet at (0, 1) and part again
        corners = np.array([[side, 2.0], [0.0, 1.2], [0.0, 0.8], [side, 0.0]])
        points = np.concatenate([np.linspace(a, b, 80) for a, b in itertools.pairwise(corners)])
        learner.start()
        learner.observe_many(points, [TaskFrame.identity(2)], (DT * np.arange(len(points))).tolist())
        learner.end()
    model = learner.model()
    for side in (1.0, -1.0):
        start = np.array([[side, 2.0]])
        first = int(np.argmin(np.linalg.norm(model.means[0] - start[0], axis=1)))
        end = chain_from(successors(model, start), first)[-1]
        np.testing.assert_allclose(model.means[0, end], [side, 0.0], atol=0.02)


def test_a_start_near_the_demonstrated_ones_begins_there_and_a_far_one_at_the_nearest():
    model = straight()
    tracker = ProgressTracker(model)
    near = tracker.start(np.array([1.0, 0.05]), gaussians(model))
    assert near.from_start
    assert model.initial[near.component] > 0
    far = tracker.start(np.array([0.5, 0.3]), gaussians(model))
    assert not far.from_start
    nearest = np.linalg.norm(model.means[0] - [0.5, 0.3], axis=1)
    assert far.component == int(np.argmin(np.where(model.terminal, np.inf, nearest)))


def follow(model: TPHSMM, path: NDArray, begin: Progress | None = None) -> list[Progress]:
    tracker, seen = ProgressTracker(model), []
    now = begin or tracker.start(path[0], gaussians(model))
    for position in path:
        now = tracker.advance(now, position, np.zeros(2), gaussians(model), DT)
        seen.append(now)
    return seen


def test_a_robot_on_time_walks_the_chain_to_its_end_and_arrives():
    model = straight()
    path = np.concatenate([np.linspace([1.0, 0.0], [0.0, 0.0], 200), np.zeros((20, 2))])
    seen = follow(model, path)
    assert seen[-1].arrived
    components = [s.component for s in seen]
    chain = [c for n, c in enumerate(components) if n == 0 or c != components[n - 1]]
    assert chain == chain_from(successors(model), chain[0])
    to_go = [ProgressTracker(model).time_to_go(s) for s in seen]
    assert to_go[0] == pytest.approx(4.0, abs=0.1)
    assert to_go[-1] == 0.0


def test_a_robot_that_is_held_waits_and_then_goes_on_after_the_time_out():
    model = straight()
    held = np.repeat([[1.0, 0.3]], 400, axis=0)  # beside the first component
    seen = follow(model, held, Progress(int(np.argmax(model.initial))))
    first = seen[0].component
    waiting = [s for s in seen if s.component == first and s.waiting]
    assert len(waiting) > 80
    assert any(s.component != first for s in seen)


def test_the_clock_of_a_component_waits_for_a_robot_that_is_held_behind():
    model = straight()
    tracker, ways = ProgressTracker(model), LocalComponents.of(model).seen([TaskFrame.identity(2)]).gaussians
    q = int(np.argmax(model.initial))
    now, entry, duration_s = Progress(q), ways.entries[q], model.duration_mean_s[q]
    for _ in range(round(2.0 * duration_s / DT)):
        now = tracker.advance(now, entry, np.zeros(2), ways, DT)
    assert now.component == q
    assert now.elapsed_s < 0.2 * duration_s < now.behind_s
    assert not now.waiting
    clock_s = []
    for fraction in np.arange(0.0, 0.8, DT / duration_s):  # let go: from here on as if nothing had been
        now = tracker.advance(now, entry + fraction * (ways.exits[q] - entry), np.zeros(2), ways, DT)
        clock_s.append(now.elapsed_s)
        if now.component != q:
            break
    assert clock_s[-2] > 0.5 * duration_s


def test_a_robot_that_is_held_far_away_never_runs_ahead_to_where_it_could_not_come_in():
    model = straight()
    held = np.repeat([[1.0, 0.3]], 600, axis=0)
    ahead = np.array([model.phase[s.component] for s in follow(model, held)])
    # there the way that remains is too short; only the tick between going on and being sent back is so far
    assert np.mean(ahead > 0.75) < 0.01


def test_a_robot_that_was_pushed_away_finds_its_component_anew():
    model = straight()
    path = np.concatenate([np.linspace([1.0, 0.0], [0.8, 0.0], 40), np.repeat([[0.3, 0.0]], 3, axis=0)])
    seen = follow(model, path)
    np.testing.assert_allclose(model.means[0, seen[41].component], [0.3, 0.0], atol=0.1)


def test_a_fast_robot_at_the_end_has_not_arrived():
    model = straight()
    terminal = int(np.flatnonzero(model.terminal)[0])
    tracker = ProgressTracker(model)
    fast = tracker.advance(Progress(terminal), np.zeros(2), np.array([0.5, 0.0]), gaussians(model), DT)
    slow = tracker.advance(Progress(terminal), np.zeros(2), np.zeros(2), gaussians(model), DT)
    assert not fast.arrived
    assert slow.arrived


def test_a_model_without_an_end_is_refused():
    model = straight()
    endless = replace(model, terminal=np.zeros(model.n_components, bool), ways=())
    with pytest.raises(InvalidModel, match="terminal"):
        ProgressTracker(endless)
