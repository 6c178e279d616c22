from __future__ import annotations

import numpy as np
from hypothesis import given, settings

from common.task_frame import TaskFrame
from remote_site.reproduction.world_components import LocalComponents, start_shift
from tests.strategies import dims, frame_counts, learned, random_frame, seeds


@settings(deadline=None, derandomize=True, max_examples=10)
@given(seed=seeds, n_dims=dims, n_frames=frame_counts)
def test_everything_moves_with_the_frames(seed: int, n_dims: int, n_frames: int):
    rng = np.random.default_rng(seed)
    model = learned(n_dims, n_frames, seed=1)
    shift = 0.01 * rng.normal(size=model.means.shape)
    frames = [random_frame(rng, n_dims) for _ in range(n_frames)]
    world = random_frame(rng, n_dims)
    moved = tuple(TaskFrame(world.A @ f.A, world.to_world(f.b)) for f in frames)
    local = LocalComponents.of(model, shift)
    here, there = local.seen(frames), local.seen(moved)
    np.testing.assert_allclose(there.gaussians.means, world.to_world(here.gaussians.means), atol=1e-7)
    np.testing.assert_allclose(there.entries, world.to_world(here.entries), atol=1e-7)
    np.testing.assert_allclose(there.ramps, here.ramps @ world.A.T, atol=1e-7)
    assert here.valid_for(tuple(frames))
    assert not here.valid_for(moved)


def test_the_ramp_passes_through_the_mean_at_the_mean_elapsed_time():
    model = learned()
    seen = LocalComponents.of(model, start_shift(model, None)).seen([TaskFrame.identity(2)])
    inner = ~model.terminal
    share = (model.elapsed_mean_s / model.duration_mean_s.clip(1e-9))[inner, None]
    at = seen.entries[inner] + share * seen.ramps[inner]
    np.testing.assert_allclose(at, model.means[0, inner], atol=1e-12)


def test_the_shares_of_the_frames_sum_to_the_identity():
    model = learned(n_frames=2)
    rng = np.random.default_rng(0)
    seen = LocalComponents.of(model, start_shift(model, None)).seen(
        [random_frame(rng, 2), random_frame(rng, 2)]
    )
    for i in range(model.n_components):
        np.testing.assert_allclose(seen.weights(i).sum(axis=0), np.eye(2), atol=1e-9)


def test_a_start_like_those_of_the_demonstrations_moves_little_and_its_own_demonstration_not_at_all():
    model = learned(n_demonstrations=1)
    np.testing.assert_allclose(start_shift(model, model.start_means[:, 0]), 0.0, atol=1e-12)
    step = np.array([0.1, 0.0])
    shift = start_shift(model, model.start_means[:, 0] + step)
    np.testing.assert_allclose(shift[0], (1.0 - model.phase)[:, None] * step, atol=1e-9)
    assert not shift[0, model.terminal].any()
