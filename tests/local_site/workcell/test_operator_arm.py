from __future__ import annotations

import numpy as np
import pytest

from farhand.deploy.places import sample_files
from farhand.evaluation.arm.arm_trial import arm_cell
from farhand.local_site.teaching.demonstration import Demonstration
from farhand.local_site.workcell.operator_arm import DEMONSTRATIONS, NotDemonstrated, demonstrations
from farhand.local_site.workcell.scripted_hand import STANDOFF_M
from tests.cells import JACO


@pytest.fixture(scope="module")
def shown() -> dict[str, Demonstration]:
    return {task: demonstrate(0, JACO) for task, demonstrate in DEMONSTRATIONS.items()}


def in_receptacle(demonstration: Demonstration) -> np.ndarray:
    return demonstration.frames_at(0)[0].to_local(demonstration.points)


def test_an_insertion_ends_with_the_plug_seated(shown: dict[str, Demonstration]):
    local = in_receptacle(shown["hot-stab"])
    assert 0.075 < local[-1, 2] < 0.090
    assert np.hypot(*local[-1, :2]) < 0.003


def test_a_withdrawal_begins_with_the_plug_seated_and_ends_with_it_held_before_the_mouth(
    shown: dict[str, Demonstration],
):
    local = in_receptacle(shown["hot-stab-removal"])
    assert 0.080 < local[0, 2] < 0.085
    in_bore = local[local[:, 2] > 0.02]
    assert np.hypot(*in_bore[:, :2].T).max() < 0.003
    np.testing.assert_allclose(local[-1, :3], [0.0, 0.0, -STANDOFF_M], atol=0.015)
    assert np.linalg.norm(local[-1, :3] - local[-30, :3]) < 0.005  # at rest


@pytest.mark.parametrize("task", DEMONSTRATIONS)
def test_poses_are_recorded_at_a_hundred_hertz(shown: dict[str, Demonstration], task: str):
    demonstration = shown[task]
    np.testing.assert_allclose(np.diff(demonstration.time_s), 0.01)
    assert demonstration.space.oriented and 500 < len(demonstration.time_s) < 1400
    assert np.linalg.norm(np.diff(demonstration.position_m, axis=0), axis=1).max() < 0.0025  # 25 cm/s


@pytest.mark.parametrize("task", DEMONSTRATIONS)
def test_the_samples_that_come_along_are_small_and_are_those_that_the_command_makes(
    shown: dict[str, Demonstration], task: str
):
    files = sample_files(task)
    assert len(files) == 5
    assert sum(file.stat().st_size for file in files) <= 300_000
    first = Demonstration.load(files[0])
    assert first.source == shown[task].source
    # Other machines round otherwise, and contact makes more of it.
    np.testing.assert_allclose(first.position_m, shown[task].position_m, atol=2e-3)
    for file in files[1:]:
        end_m = Demonstration.load(file).in_frame()[-1, 2]
        assert end_m > 0.075 if task == "hot-stab" else end_m == pytest.approx(-STANDOFF_M, abs=0.015)


def test_a_seed_whose_plug_is_not_seated_is_left_out_and_told_and_the_next_one_takes_its_place():
    told: list[str] = []
    cell = arm_cell("iiwa7")
    first, second = demonstrations("hot-stab", 2, 0, cell, lambda reason: told.append(str(reason)))
    assert told == ["seed 0: the plug ends 19 mm deep"]
    expected = DEMONSTRATIONS["hot-stab"](1, cell), DEMONSTRATIONS["hot-stab"](2, cell)
    for each, alone in zip((first, second), expected, strict=True):
        np.testing.assert_array_equal(each.points, alone.points)
    with pytest.raises(NotDemonstrated, match="seed 0"):
        DEMONSTRATIONS["hot-stab"](0, cell)
