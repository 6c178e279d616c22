"""Folder of a task: its demonstrations, its revisions, its newest model.

A model is a function of its demonstrations in their order, so any revision can be learned again bit for bit.
The list of revisions is written after the files that it names: a process that is killed leaves at most a file
that no revision names.
"""

from __future__ import annotations

import contextlib
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from farhand.common.errors import FarhandError
from farhand.common.whole_file import write_whole
from farhand.local_site.teaching.demonstration import Demonstration
from farhand.local_site.teaching.revisions import Revision, Revisions

_NEWEST = "newest.farhand"
_INDEX = "library.json"


class NotSaved(FarhandError):
    """Failure to write a change to disk; in memory it was made."""


@dataclass(frozen=True)
class StoredDemonstration:
    """Demonstration with the name of its file."""

    name: str
    demonstration: Demonstration

    @classmethod
    def made_now(cls, demonstration: Demonstration) -> StoredDemonstration:
        """Return a demonstration with a new file name, which contains the present time."""
        # One instant, in UTC: a lost list is made again from the names in their order.
        return cls(f"demonstration-{datetime.now(UTC):%Y%m%dT%H%M%S-%f}.npz", demonstration)


class TaskArchive:
    """Files of one task.

    Args:
        folder: Folder of the task, created when something is written.
    """

    def __init__(self, folder: Path):
        self._folder = folder
        self.revisions = Revisions(folder / _INDEX)

    def load(self, revision: Revision) -> tuple[StoredDemonstration, ...]:
        """Load the demonstrations of a revision.

        Raises:
            InvalidDemonstration: When a file is missing or damaged.
        """
        return tuple(self.load_one(name) for name in revision.demonstrations)

    def load_one(self, name: str) -> StoredDemonstration:
        """Load the demonstration in a file of the folder; errors as `load`."""
        return StoredDemonstration(name, Demonstration.load(self._folder / name))

    def set_aside(self, name: str) -> None:
        """Rename a damaged file, so that it is not read again."""
        with contextlib.suppress(OSError):
            (self._folder / name).rename(self._folder / f"{name}.damaged")

    def commit(self, kept: tuple[StoredDemonstration, ...], sha256: str, content: bytes) -> None:
        """Store these demonstrations, in this order, as the current revision.

        Args:
            kept: All demonstrations of the revision.
            sha256: SHA-256 of the model learned from them; empty without any.
            content: Bytes of the model.

        Raises:
            NotSaved: When it is current, but not on disk.
        """
        before = self.revisions.names
        self.revisions.commit(tuple(each.name for each in kept), sha256)
        self._save(before, kept, content)

    def forget(self, number: int) -> None:
        """Drop a revision that is not current, with the demonstrations that it alone has.

        Raises:
            NotSaved: When it was dropped, but not on disk.
        """
        before = self.revisions.names
        self.revisions.forget(number)
        self._save(before)

    def _save(
        self, before: set[str], kept: tuple[StoredDemonstration, ...] = (), content: bytes | None = None
    ) -> None:
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            for each in kept:
                if not (path := self._folder / each.name).exists():
                    each.demonstration.save(path)
            self.revisions.save()
            for name in before - self.revisions.names:
                (self._folder / name).unlink(missing_ok=True)
            if content:
                write_whole(self._folder / _NEWEST, content)
            elif content is not None:
                (self._folder / _NEWEST).unlink(missing_ok=True)
        except OSError as error:
            raise NotSaved(
                f"kept in memory only: {self._folder} cannot be written ({error.strerror})"
            ) from error
