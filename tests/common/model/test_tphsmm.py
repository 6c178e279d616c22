from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from farhand.common.errors import InvalidModel
from farhand.common.model.manifold import POSE
from farhand.common.model.tphsmm import ARRAY_FIELDS
from tests.strategies import learned


def test_equal_content_makes_equal_models():
    assert learned(seed=1) == learned(seed=1)
    assert hash(learned(seed=1)) == hash(learned(seed=1))
    assert learned(seed=1) != learned(seed=2)
    assert replace(learned(), frame_names=("other",)) != learned()


def test_arrays_are_copies_that_cannot_be_written():
    model = learned()
    for name in ARRAY_FIELDS:
        with pytest.raises(ValueError, match="read-only"):
            getattr(model, name)[...] = 0
    mine = np.array(model.means)
    copy = replace(model, means=mine)
    mine[...] = 7.0
    assert copy == model


def test_sizes_are_those_of_the_means():
    model = learned(3, n_frames=2)
    assert (model.n_frames, model.n_components, model.n_dims) == model.means.shape


@pytest.mark.parametrize("name", [name for name in ARRAY_FIELDS if name != "means"])
def test_a_wrong_shape_names_its_field(name: str):
    model = learned()
    with pytest.raises(InvalidModel, match=name):
        replace(model, **{name: getattr(model, name)[..., :-1]})


@pytest.mark.parametrize("name", [n for n, (_, kind) in ARRAY_FIELDS.items() if kind is np.float64])
def test_a_nan_names_its_field(name: str):
    model = learned()
    broken = np.array(getattr(model, name))
    broken.flat[0] = np.nan
    with pytest.raises(InvalidModel, match=f"{name}: finite"):
        replace(model, **{name: broken})


def _first(array: np.ndarray, value: float) -> np.ndarray:
    changed = np.array(array)
    changed.flat[0] = value
    return changed


def test_each_invariant_is_checked():
    model = learned()
    terminal = int(np.flatnonzero(model.terminal)[0])
    leaves = np.array(model.exit)
    leaves[terminal] = 0.5
    stays = np.array(model.transition)
    stays[terminal, 0] = 0.5
    loop = np.array(model.transition)
    loop[0] = 0.0
    loop[0, 0] = 1.0
    broken = {
        "initial": {"initial": 2.0 * model.initial},
        "transition, exit": {"transition": 0.5 * model.transition},
        "transition: a zero diagonal": {"transition": loop, "exit": _first(model.exit, 0.0)},
        "duration_mean_s: no negative": {"duration_mean_s": _first(model.duration_mean_s, -1.0)},
        "duration_variance_s2: positive": {"duration_variance_s2": _first(model.duration_variance_s2, 0.0)},
        "covariances: positive definite": {"covariances": -model.covariances},
        "residual_covariances: symmetric": {
            "residual_covariances": model.residual_covariances + 0.1 * np.triu(np.ones((2, 2)), 1)
        },
        "exit: 1 for every terminal": {"exit": leaves, "transition": stays},
        "max_distance_m": {"max_distance_m": 0.0},
        "n_demonstrations": {"n_demonstrations": -1},
        "frame_names: 1 names": {"frame_names": ("a", "b")},
        "counts: type int64": {"counts": model.counts.astype(float)},
    }
    for message, change in broken.items():
        with pytest.raises(InvalidModel, match=message):
            replace(model, **change)


def test_starts_of_poses_vary_in_position_and_rotation_each_by_itself():
    model = learned(POSE)
    mixed = np.array(model.start_covariances)
    mixed[..., 0, 4] = mixed[..., 4, 0] = 1e-6
    with pytest.raises(InvalidModel, match="start_covariances: zeros between position and rotation"):
        replace(model, start_covariances=mixed)


def test_paths_are_counted_from_starts_that_reach_an_end():
    model = learned(n_demonstrations=1)
    assert model.n_paths == 1
    cut = np.zeros_like(model.transition)
    assert replace(model, transition=cut, exit=np.ones(model.n_components)).n_paths == 0


def test_means_of_a_wrong_shape_are_refused():
    for means in (np.zeros((2, 2)), np.zeros((1, 0, 2)), np.zeros((1, 5000, 2))):
        with pytest.raises(InvalidModel, match="means: shape"):
            replace(learned(), means=means)
