from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings

from farhand.common.model.manifold import POSE, Manifold
from farhand.local_site.learning.way_regression import less_by_chance
from tests.strategies import random_covariances, seeds, spaces


@settings(deadline=None, derandomize=True, max_examples=20)
@given(seed=seeds, space=spaces)
def test_covariances_of_few_demonstrations_keep_their_traces_and_are_rounder(seed: int, space: Manifold):
    rng = np.random.default_rng(seed)
    sigma = random_covariances(rng, 2, 5, space.n_tangent)
    few, many = (less_by_chance(sigma, np.full((2, 5), n), space) for n in (3.0, 1e9))
    np.testing.assert_allclose(many, sigma, rtol=1e-6, atol=1e-9 * np.abs(sigma).max())
    for part in space.parts:
        block, rounder = sigma[..., part, part], few[..., part, part]
        np.testing.assert_allclose(np.trace(rounder, axis1=-2, axis2=-1), np.trace(block, axis1=-2, axis2=-1))
        spread = [np.linalg.eigvalsh(a) for a in (block, rounder)]
        assert (spread[1][..., 0] >= spread[0][..., 0] - 1e-12).all()
        assert (spread[1][..., -1] <= spread[0][..., -1] + 1e-12).all()
    assert np.linalg.eigvalsh(few).min() > 0.0


@pytest.mark.parametrize("space", [Manifold(2), Manifold(3), POSE])
def test_a_direction_that_few_demonstrations_know_by_chance_is_believed_less(space: Manifold):
    """Six places along a line: a frame that sees them so must not hold the line against one that knows the place."""
    line = np.zeros((space.n_tangent, space.n_tangent))
    line[0, 0] = 1.0
    wider = less_by_chance(line[None], np.array([6.0]), space)[0]
    assert wider[1, 1] == pytest.approx(1.0 / (6.0 + space.n_dims))
