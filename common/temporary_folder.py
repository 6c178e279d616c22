"""Folder for temporary files, this user's own folder in it, and the error when no such folder can be written."""

from __future__ import annotations

import os
import stat
import tempfile
from pathlib import Path

from farhand.common.errors import FarhandError


class NoTemporaryFolder(FarhandError):
    """Error when temporary files cannot be written."""


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


def own_temporary_folder() -> Path:
    """Return the path of this user's folder for temporary files; it need not exist.

    Raises:
        NoTemporaryFolder: When no temporary files can be written.
    """
    return temporary_folder() / f"farhand-{os.geteuid()}"


def is_own(folder: Path) -> bool:
    """Decide whether a folder is this user's, and nobody else may write there.

    Anybody may make a folder of any name among the temporary files before its user does.
    """
    try:
        there = folder.lstat()
    except OSError:
        return False
    return stat.S_ISDIR(there.st_mode) and there.st_uid == os.geteuid() and not there.st_mode & 0o022
