from __future__ import annotations

import numpy as np
import pytest

from deploy.places import sample_files
from local_site.demonstration import Demonstration
from local_site.operator_arm import demonstrate


@pytest.fixture(scope="module")
def shown() -> Demonstration:
    return demonstrate(0)


def test_a_demonstration_ends_with_the_plug_seated(shown: Demonstration):
    local = shown.frames_at(0)[0].to_local(shown.points)
    assert 0.075 < local[-1, 2] < 0.090
    assert np.hypot(*local[-1, :2]) < 0.003


def test_poses_are_recorded_at_a_hundred_hertz(shown: Demonstration):
    np.testing.assert_allclose(np.diff(shown.time_s), 0.01)
    assert shown.space.oriented and 700 < len(shown.time_s) < 1400
    assert np.linalg.norm(np.diff(shown.position_m, axis=0), axis=1).max() < 0.0025  # 25 cm/s


def test_the_samples_that_come_along_are_small_and_are_those_that_the_command_makes(shown: Demonstration):
    files = sample_files("hot-stab")
    assert len(files) == 5
    assert sum(file.stat().st_size for file in files) <= 300_000
    first = Demonstration.load(files[0])
    assert first.source == shown.source
    # Other machines round otherwise, and contact makes more of it.
    np.testing.assert_allclose(first.position_m, shown.position_m, atol=2e-3)
    for file in files[1:]:
        sample = Demonstration.load(file)
        assert sample.in_frame()[-1, 2] > 0.075
