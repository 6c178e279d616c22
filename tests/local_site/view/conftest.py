"""What there is to show before anything has happened."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from farhand.common.task import TaskSet
from farhand.local_site.console.console import Console
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.teaching.library import Library
from farhand.local_site.teaching.samples import sample_strokes
from farhand.local_site.teaching.task_library import TaskLibrary
from tests.local_site.robot_end import TASK
from tests.local_site.view.panels.test_truth import OK
from tests.loopback import OperatorsEnd


@pytest.fixture
def nothing_yet(tmp_path: Path) -> ConsoleState:
    """Of the planar task, without a robot."""
    return Console(Library(TaskSet([TASK]), tmp_path), OperatorsEnd(), "ann").picture


@pytest.fixture
def taught(nothing_yet: ConsoleState, tmp_path: Path) -> ConsoleState:
    """Taught, and the robot has it."""
    library = TaskLibrary(TASK, tmp_path / "taught")
    library.learn(sample_strokes(TASK))
    learned = library.learned
    assert learned is not None
    task = replace(
        nothing_yet.tasks[0], learned_sha256=learned.sha256, confirmed_sha256=learned.sha256, robot_does=True
    )
    return replace(
        nothing_yet, link=OK, in_control=True, learned=learned, demonstrations=library.demonstrations, tasks=(task,),
        demonstration_names=library.demonstration_names, strokes=library.strokes, stroke_frames=library.stroke_frames,
        robot_model=learned, confirmed_sha256=learned.sha256, can_undo=True,
    )  # fmt: skip
