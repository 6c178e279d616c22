from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from farhand.local_site.workcell.scripted_hand import (
    STANDOFF_M,
    ScriptedExtraction,
    ScriptedInsertion,
    ScriptedPath,
)

DEPTH_M = 0.085
OUTSIDE = np.array([0.05, -0.1, -0.25, *Rotation.from_rotvec([0.2, -0.3, 0.1]).as_quat(scalar_first=True)])
SEATED = np.array([0.0002, -0.0003, 0.084, 1.0, 0.0, 0.0, 0.0])


def way_in(seed: int) -> ScriptedPath:
    return ScriptedInsertion(OUTSIDE, DEPTH_M, np.random.default_rng(seed))


def way_out(seed: int) -> ScriptedPath:
    return ScriptedExtraction(SEATED, np.random.default_rng(seed))


def positions(way: ScriptedPath) -> np.ndarray:
    return np.array([way.at(t)[0] for t in np.arange(0.0, way.duration_s, 0.01)])


@pytest.mark.parametrize("seed", range(5))
def test_ways_begin_where_the_plug_is_and_end_where_they_should(seed: int):
    into, out = positions(way_in(seed)), positions(way_out(seed))
    np.testing.assert_allclose(into[0], OUTSIDE[:3], atol=1e-12)
    np.testing.assert_allclose(into[-1], [0.0, 0.0, DEPTH_M - 0.002], atol=1e-9)
    np.testing.assert_allclose(out[0], SEATED[:3], atol=1e-12)
    np.testing.assert_allclose(out[-1], [0.0, 0.0, -STANDOFF_M], atol=0.012)


@pytest.mark.parametrize("make", [way_in, way_out])
def test_ways_are_smooth_rest_at_both_ends_and_are_aligned_at_the_mouth(make: type):
    way = make(1)
    steps = np.linalg.norm(np.diff(positions(way), axis=0), axis=1)
    assert steps.max() < 0.0025 and np.abs(np.diff(steps)).max() < 5e-5
    assert steps[0] < 1e-5 and steps[-1] < 1e-9
    for t in np.arange(0.0, way.duration_s, 0.01):
        position, turn, free = way.at(t)
        assert 0.0 <= free <= 1.0
        if abs(position[2]) < 0.01:
            assert turn.magnitude() < 1e-6
    assert way.at(0.0)[2] == 0.0


def test_a_way_out_goes_straight_along_the_axis():
    out = positions(way_out(2))
    assert (np.diff(out[:, 2]) <= 0.0).all()
    in_bore = out[out[:, 2] > 0.0]
    assert np.hypot(*in_bore[:, :2].T).max() < 0.006
