"""Several tasks of one robot, taught one at a time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from msgspec import structs

from farhand.common.task import TaskSet
from farhand.local_site.teaching.library import Library
from farhand.local_site.teaching.samples import sample_strokes
from farhand.local_site.teaching.teaching_permission import NotNow
from tests.local_site.robot_end import FRAMES, TASK, stroke

OTHER = structs.replace(TASK, name="other")


@pytest.fixture
def library(tmp_path: Path) -> Library:
    return Library(TaskSet([TASK, OTHER]), tmp_path)


def test_it_begins_with_the_first_task_and_each_is_taught_and_kept_by_itself(
    library: Library, tmp_path: Path
):
    assert library.task is TASK and not library.learned
    samples = sample_strokes(TASK)
    library.chosen.learn(samples)
    library.choose("other")
    assert library.task is OTHER and library.chosen.learned is None
    library.chosen.learn(samples[:1])
    one, other = library.learned["planar"], library.learned["other"]
    assert (one.model.n_demonstrations, other.model.n_demonstrations) == (3, 1)
    later = Library(TaskSet([TASK, OTHER]), tmp_path)
    assert {name: each.sha256 for name, each in later.learned.items()} == {
        "planar": one.sha256,
        "other": other.sha256,
    }


def test_another_task_is_not_chosen_in_the_middle_of_a_demonstration(library: Library):
    library.chosen.record(FRAMES)
    with pytest.raises(NotNow, match="recorded"):
        library.choose("other")
    assert library.task is TASK and library.recording


def test_a_task_that_is_not_there_is_not_chosen(library: Library):
    with pytest.raises(NotNow, match="only planar and other"):
        library.choose("hot-stab")
    assert library.task is TASK


def test_what_the_hand_moves_through_is_learned_while_a_demonstration_is_made(library: Library):
    points, times_s = stroke()
    library.on_moved(points, times_s)
    assert not library.chosen.current
    library.choose("other")
    library.chosen.record(FRAMES)
    library.on_moved(points, times_s)
    library.chosen.end()
    assert list(library.learned) == ["other"]
    np.testing.assert_allclose(library.chosen.strokes[0][-1], points[-1], atol=0.02)
