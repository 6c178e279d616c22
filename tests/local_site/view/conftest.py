"""What there is to show before anything has happened."""

from __future__ import annotations

from pathlib import Path

import pytest

from farhand.common.task import TaskSet
from farhand.local_site.console.console import Console
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.teaching.library import Library
from tests.local_site.robot_end import TASK
from tests.loopback import OperatorsEnd


@pytest.fixture
def nothing_yet(tmp_path: Path) -> ConsoleState:
    """Of the planar task, without a robot."""
    return Console(Library(TaskSet([TASK]), tmp_path), OperatorsEnd(), "ann").picture
