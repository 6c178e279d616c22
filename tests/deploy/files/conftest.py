"""The folder that these tests read."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.deploy.files.recordings import make_files


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """See `make_files`."""
    folder = tmp_path_factory.mktemp("files")
    make_files(folder)
    return folder
