from __future__ import annotations

from typing import Any

import msgspec
import pytest

from farhand.common.errors import InvalidConfiguration
from farhand.common.task import ArmTask, Landmark, Limits, TaskSet
from farhand.common.wire.messages import MOST_TASKS
from farhand.common.wire.reason_words import sentence
from farhand.deploy.places import find_task, find_tasks

STAB, REMOVAL, PLANAR = find_task("hot-stab"), find_task("hot-stab-removal"), find_task("planar")


def test_tasks_of_one_arm_are_found_by_their_names_and_the_first_comes_first():
    tasks = TaskSet([STAB, REMOVAL])
    assert tasks.names == ("hot-stab", "hot-stab-removal")
    assert tasks.first is STAB and list(tasks) == [STAB, REMOVAL] and len(tasks) == 2
    assert tasks.get("hot-stab-removal") is REMOVAL
    assert tasks.get("planar") is None


def test_there_must_be_a_task_and_each_only_once():
    with pytest.raises(InvalidConfiguration, match="one task or more"):
        TaskSet([])
    with pytest.raises(InvalidConfiguration, match="each task once"):
        TaskSet([STAB, STAB])
    many = [msgspec.structs.replace(STAB, name=f"stab-{n}") for n in range(MOST_TASKS + 1)]
    assert len(TaskSet(many[1:])) == MOST_TASKS
    with pytest.raises(InvalidConfiguration, match=f"{MOST_TASKS} at most"):
        TaskSet(many)


def test_a_task_that_is_not_done_is_refused_in_words_that_name_those_that_are():
    tasks = TaskSet([STAB, REMOVAL])
    assert tasks.refusal("hot-stab-removal") is None
    assert (
        sentence(tasks.refusal("planar")) == "this robot does 'hot-stab' and 'hot-stab-removal', not 'planar'"
    )


@pytest.mark.parametrize(
    ("field", "others"),
    [
        ("frame_names", {"frame_names": ("handle", "receptacle"), "landmarks": {"handle": Landmark()}}),
        ("limits", {"limits": Limits(force_n=100.0)}),
        ("disturbances", {"disturbances": "rough"}),
    ],
)
def test_one_robot_does_them_all_or_the_field_that_differs_is_named(field: str, others: dict[str, Any]):
    assert isinstance(REMOVAL, ArmTask)
    with pytest.raises(InvalidConfiguration, match=rf"'hot-stab-removal'.*{field}.*'hot-stab'"):
        TaskSet([STAB, msgspec.structs.replace(REMOVAL, **others)])


def test_an_arm_does_not_do_the_task_of_a_point():
    with pytest.raises(InvalidConfiguration, match="robot"):
        TaskSet([STAB, PLANAR])


def test_names_are_read_with_commas_between_them():
    assert find_tasks("hot-stab, hot-stab-removal").names == ("hot-stab", "hot-stab-removal")
    assert find_tasks("planar").names == ("planar",)
    with pytest.raises(InvalidConfiguration, match="hot-stba"):
        find_tasks("hot-stab,hot-stba")
