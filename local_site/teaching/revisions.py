"""Revisions of a task: the demonstrations of each, which one is current, and what an undo goes back to."""

from __future__ import annotations

import contextlib
import re
from datetime import UTC, datetime
from pathlib import Path

import msgspec

from farhand.common.errors import InvalidConfiguration
from farhand.common.whole_file import fault_of, read_whole, write_whole

KEPT = 5
_SCHEMA = 1
_NAME = re.compile(r"[A-Za-z0-9._-]{1,128}\.npz")


class Revision(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """State of a task's lesson.

    Args:
        number: Counts from 1, never used twice.
        parent: Number of the revision that it was made from, 0 for none.
        sha256: SHA-256 of the model's bytes; empty without a demonstration.
        demonstrations: File names, in the order in which they were learned.
        made: Wall time of its making, for people.
        held: True if it stays until it is deleted, because the operator left it on purpose.
    """

    number: int
    parent: int
    sha256: str
    demonstrations: tuple[str, ...]
    made: str
    held: bool = False


class _Index(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    schema: int = _SCHEMA
    current: int = 0
    last: int = 0
    revisions: tuple[Revision, ...] = ()

    def __post_init__(self) -> None:
        if self.schema != _SCHEMA:
            raise ValueError(f"schema {self.schema}")
        if not all(_NAME.fullmatch(name) for revision in self.revisions for name in revision.demonstrations):
            raise ValueError("a demonstration with another name than Farhand gives")
        for revision in self.revisions:
            datetime.fromisoformat(revision.made)
        numbers = [revision.number for revision in self.revisions]
        if len(set(numbers)) < len(numbers) or not all(1 <= number <= self.last for number in numbers):
            raise ValueError(f"numbers from 1 to {self.last}, each once, got {numbers}")
        if self.current and self.current not in numbers:
            raise ValueError(f"the revision {self.current}, which counts, is not listed")


class Revisions:
    """Newest revisions, and the file that lists them.

    Args:
        path: Path of the file.
    """

    def __init__(self, path: Path):
        self._path = path
        self.faults: tuple[str, ...] = ()
        """Faults of the file, for the operator."""
        self._index = self._load()

    @property
    def kept(self) -> tuple[Revision, ...]:
        """All kept revisions, the newest last."""
        return self._index.revisions

    @property
    def current(self) -> Revision | None:
        """Current revision; None before the first."""
        return self.get(self._index.current)

    @property
    def names(self) -> set[str]:
        """File names of all revisions' demonstrations."""
        return {name for revision in self.kept for name in revision.demonstrations}

    def get(self, number: int) -> Revision | None:
        """Return the revision with this number, if it is kept."""
        return next((revision for revision in self.kept if revision.number == number), None)

    def n_after_undo(self, names: tuple[str, ...]) -> int:
        """Return how many of these demonstrations an undo keeps: as many as an earlier revision had.

        Those after them were learned together.
        """
        starts = [
            len(r.demonstrations) for r in self.kept if r.demonstrations == names[: len(r.demonstrations)]
        ]
        if self.kept and self.kept[0].number == 1:
            starts.append(0)  # the state before the first revision
        return max((n for n in starts if n < len(names)), default=max(len(names) - 1, 0))

    def commit(self, demonstrations: tuple[str, ...], sha256: str) -> None:
        """Make the revision with these demonstrations current; add one if none has exactly these.

        When there are too many, the oldest that is not held is dropped.
        """
        for revision in self.kept:
            if (revision.demonstrations, revision.sha256) == (demonstrations, sha256):
                self._index = msgspec.structs.replace(self._index, current=revision.number)
                return
        number = self._index.last + 1
        made = datetime.now(UTC).isoformat(timespec="seconds")
        new = Revision(number, self._index.current, sha256, demonstrations, made)
        surplus = [each.number for each in self.kept if not each.held][: -(KEPT - 1)]
        rest = (each for each in self.kept if each.number not in surplus)
        self._index = _Index(_SCHEMA, number, number, (*rest, new))

    def hold(self) -> None:
        """Keep the current revision until it is deleted, if it has demonstrations."""
        kept = tuple(
            msgspec.structs.replace(each, held=True)
            if each.number == self._index.current and each.demonstrations
            else each
            for each in self.kept
        )
        self._index = msgspec.structs.replace(self._index, revisions=kept)

    def forget(self, number: int) -> None:
        """Drop a revision."""
        rest = tuple(revision for revision in self.kept if revision.number != number)
        self._index = msgspec.structs.replace(self._index, revisions=rest)

    def save(self) -> None:
        """Write the list, whole or not at all.

        Raises:
            OSError: When it cannot be written.
        """
        write_whole(self._path, msgspec.json.format(msgspec.json.encode(self._index), indent=1))

    def _load(self) -> _Index:
        if not self._path.exists():
            return _Index()
        try:
            with fault_of(self._path, InvalidConfiguration, "a list of revisions"):
                return msgspec.json.decode(read_whole(self._path), type=_Index)
        except InvalidConfiguration as error:
            aside = self._path.with_suffix(".unreadable")
            with contextlib.suppress(OSError):
                self._path.replace(aside)
            return self._from_files(
                f"the list of what was taught is damaged and kept as {aside.name}: {error}"
            )

    def _from_files(self, fault: str) -> _Index:
        """Rebuild a lost list from the demonstrations in the folder: one revision, not current yet."""
        names = tuple(
            sorted(file.name for file in self._path.parent.glob("*.npz") if _NAME.fullmatch(file.name))
        )
        if not names:
            self.faults = (fault,)
            return _Index()
        self.faults = (
            f"{fault}; the {len(names)} demonstrations in the folder are revision 1: go to it, or start anew",
        )
        made = datetime.now(UTC).isoformat(timespec="seconds")
        return _Index(_SCHEMA, 0, 1, (Revision(1, 0, "", names, made, held=True),))
