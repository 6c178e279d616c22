"""The folder for temporary files, and what is said when there is none."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from farhand.common.errors import FarhandError


class NoTemporaryFolder(FarhandError):
    """Temporary files have no place."""


def temporary_folder() -> Path:
    """Return the folder for temporary files.

    Raises:
        NoTemporaryFolder: When none can be written; names the variable that chooses one.
    """
    try:
        return Path(tempfile.gettempdir())
    except OSError as error:
        tried = os.environ.get("TMPDIR")
        got = f"TMPDIR={tried}" if tried else "no TMPDIR, and /tmp"
        raise NoTemporaryFolder(
            f"no temporary folder can be written ({got}): set the variable TMPDIR to a folder with room"
        ) from error
