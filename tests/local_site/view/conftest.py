"""What there is to show before anything has happened."""

from __future__ import annotations

from pathlib import Path

import pytest

from common.repertoire import Repertoire
from local_site.console import Console
from local_site.library import Library
from local_site.picture import Picture
from tests.local_site.robot_end import TASK
from tests.loopback import Loopback


@pytest.fixture
def nothing_yet(tmp_path: Path) -> Picture:
    """Of the planar task, without a robot."""
    return Console(Library(Repertoire([TASK]), tmp_path), Loopback(), "ann").picture
