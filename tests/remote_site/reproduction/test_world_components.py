from __future__ import annotations

import numpy as np
from hypothesis import given, settings

from farhand.common.model.task_frame import TaskFrame
from farhand.remote_site.reproduction.world_components import LocalComponents
from tests.strategies import dims, frame_counts, learned, random_frame, seeds


@settings(deadline=None, derandomize=True, max_examples=10)
@given(seed=seeds, n_dims=dims, n_frames=frame_counts)
def test_everything_moves_with_the_frames(seed: int, n_dims: int, n_frames: int):
    rng = np.random.default_rng(seed)
    model = learned(n_dims, n_frames, seed=1)
    frames = [random_frame(rng, n_dims) for _ in range(n_frames)]
    world = random_frame(rng, n_dims)
    moved = tuple(TaskFrame(world.A @ f.A, world.to_world(f.b)) for f in frames)
    local = LocalComponents.of(model)
    here, there = local.seen(frames), local.seen(moved)
    np.testing.assert_allclose(there.gaussians.means, world.to_world(here.gaussians.means), atol=1e-7)
    np.testing.assert_allclose(there.entries, world.to_world(here.entries), atol=1e-7)
    np.testing.assert_allclose(there.ramps, here.ramps @ world.A.T, atol=1e-7)
    assert here.valid_for(tuple(frames))
    assert not here.valid_for(moved)


def test_the_ramp_passes_through_the_mean_at_the_mean_elapsed_time():
    model = learned()
    seen = LocalComponents.of(model).seen([TaskFrame.identity(2)])
    inner = ~model.terminal
    share = (model.elapsed_mean_s / model.duration_mean_s.clip(1e-9))[inner, None]
    at = seen.entries[inner] + share * seen.ramps[inner]
    np.testing.assert_allclose(at, model.means[0, inner], atol=1e-12)


def test_the_shares_of_the_frames_sum_to_the_identity():
    model = learned(n_frames=2)
    rng = np.random.default_rng(0)
    seen = LocalComponents.of(model).seen([random_frame(rng, 2), random_frame(rng, 2)])
    for i in range(model.n_components):
        np.testing.assert_allclose(seen.weights(i).sum(axis=0), np.eye(2), atol=1e-9)
