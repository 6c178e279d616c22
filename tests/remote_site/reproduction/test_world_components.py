from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from farhand.common.model.manifold import Manifold
from farhand.common.model.task_frame import TaskFrame
from farhand.remote_site.reproduction.progress import ProgressTracker
from farhand.remote_site.reproduction.reference import reference
from farhand.remote_site.reproduction.world_components import LocalComponents
from tests.strategies import dims, frame_counts, learned, random_frame, seeds, spaces


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


@settings(deadline=None, derandomize=True, max_examples=10)
@given(seed=seeds, space=spaces, n_frames=frame_counts)
def test_components_that_are_put_into_the_world_when_needed_are_where_all_together_are(
    seed: int, space: Manifold, n_frames: int
):
    rng = np.random.default_rng(seed)
    model = learned(space, n_frames, seed=1)
    local, frames = LocalComponents.of(model), [random_frame(rng, space.n_dims) for _ in range(n_frames)]
    whole = local.seen(frames)
    which = rng.permutation(model.n_components)[:2]
    some = local.seen(frames, which)
    for _ in range(2):
        for name in ("means", "precisions", "part_precisions", "entries", "exits", "way_precisions"):
            np.testing.assert_array_equal(
                getattr(some.gaussians, name)[which], getattr(whole.gaussians, name)[which]
            )
        np.testing.assert_array_equal(some.ramps[which], whole.ramps[which])
        np.testing.assert_array_equal(some.precisions[which], whole.precisions[which])
        some.gaussians.see(None)
        which = np.arange(model.n_components)


@settings(deadline=None, derandomize=True, max_examples=10)
@given(seed=seeds, horizon_s=st.floats(0.1, 5.0))
def test_the_components_that_a_tick_needs_are_those_of_its_reference(seed: int, horizon_s: float):
    model = learned(2, seed=seed % 5)
    tracker, dt = ProgressTracker(model), 0.02
    whole = LocalComponents.of(model).seen([TaskFrame.identity(2)])
    for q in range(model.n_components):
        ahead = set(tracker.ahead(q, horizon_s).tolist())
        for begin in {q, int(tracker.successors[q])} - {-1}:
            for waiting in (False, True):
                labels, _, _ = reference(
                    begin, 0.0, waiting, tracker.successors, tracker.durations_s,
                    whole.entries, whole.ramps, whole.precisions, int(horizon_s / dt), dt,
                )  # fmt: skip
                assert set(labels.tolist()) <= ahead
