"""A task's folder: its demonstrations, its revisions, its newest model.

A model is a function of its demonstrations, in their order, so that any revision can be learned again, bit
for bit. The list of revisions is written after what it names: a process that is killed leaves at most a
file that no revision names.
"""

from __future__ import annotations

import contextlib
import time
from dataclasses import dataclass
from pathlib import Path

from farhand.common.errors import FarhandError
from farhand.common.whole_file import write_whole
from farhand.local_site.teaching.demonstration import Demonstration
from farhand.local_site.teaching.revisions import Revision, Revisions

_NEWEST = "newest.farhand"
_INDEX = "library.json"


class NotSaved(FarhandError):
    """What was learned or undone counts, but could not be written to disk."""


@dataclass(frozen=True)
class StoredDemonstration:
    """A demonstration and the name of its file."""

    name: str
    demonstration: Demonstration

    @classmethod
    def made_now(cls, demonstration: Demonstration) -> StoredDemonstration:
        """One that was made just now."""
        name = f"demonstration-{time.strftime('%Y%m%dT%H%M%S')}-{time.time_ns() % 10**9 // 1000:06d}.npz"
        return cls(name, demonstration)


class TaskArchive:
    """One task on disk.

    Args:
        folder: Made when something is written.
    """

    def __init__(self, folder: Path):
        self._folder = folder
        self.revisions = Revisions(folder / _INDEX)

    def load(self, revision: Revision) -> tuple[StoredDemonstration, ...]:
        """The demonstrations of a revision.

        Raises:
            InvalidDemonstration: When a file is missing or damaged.
        """
        return tuple(self.load_one(name) for name in revision.demonstrations)

    def load_one(self, name: str) -> StoredDemonstration:
        """The demonstration in a file of the folder; errors as `load`."""
        return StoredDemonstration(name, Demonstration.load(self._folder / name))

    def set_aside(self, name: str) -> None:
        """Give a damaged file a name under which nothing looks for it, or removes it."""
        with contextlib.suppress(OSError):
            (self._folder / name).rename(self._folder / f"{name}.damaged")

    def settle(self, kept: tuple[StoredDemonstration, ...], sha256: str, content: bytes) -> None:
        """Have these demonstrations count, in this order.

        Args:
            kept: All of them.
            sha256: Of the model that was learned from them; empty without any.
            content: Its bytes.

        Raises:
            NotSaved: When it counts, but not on disk.
        """
        before = self.revisions.names
        self.revisions.settle(tuple(each.name for each in kept), sha256)
        self._save(before, kept, content)

    def forget(self, number: int) -> None:
        """Give a revision up that does not count, with the demonstrations that it alone has.

        Raises:
            NotSaved: When it was given up, but not on disk.
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
