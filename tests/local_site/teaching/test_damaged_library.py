"""A library of which files are damaged: each is set aside and named, the rest counts, nothing sound is lost."""

from __future__ import annotations

import errno
import os
import zipfile
from collections.abc import Callable
from dataclasses import replace
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest

from farhand.common.model.model_file import load
from farhand.local_site.teaching.demonstration import Demonstration
from farhand.local_site.teaching.samples import sample_strokes
from farhand.local_site.teaching.task_archive import NotSaved
from farhand.local_site.teaching.task_library import TaskLibrary
from tests.local_site.robot_end import FRAMES, TASK, stroke


def taught(data_dir: Path) -> list[Path]:
    """Three demonstrations one after the other; their files in that order."""
    library = TaskLibrary(TASK, data_dir)
    for sample in sample_strokes(TASK):
        library.learn([sample])
    names = library.revisions[-1].demonstrations
    return [data_dir / TASK.name / name for name in names]


def rewritten(change: Callable[[bytes], bytes]) -> Callable[[Path], None]:
    return lambda file: (file.write_bytes(change(file.read_bytes())), None)[1]


def claiming_terabytes(data: bytes) -> bytes:
    """The archive with one array whose header claims 75 GB and more."""
    out = BytesIO()
    with zipfile.ZipFile(BytesIO(data)) as old, zipfile.ZipFile(out, "w") as new:
        for member in old.namelist():
            content = old.read(member)
            if member == "position_m.npy":
                start = content.index(b"(")
                content = content[:start] + b"(9999999999, 2)" + content[start + 15 :]
            new.writestr(member, content)
    return out.getvalue()


def with_bit(data: bytes, mark: bytes, offset: int) -> bytes:
    """The lowest bit of a byte after the first mark set: of the flags of a header that an archive has an entry by."""
    at = data.index(mark) + offset
    return data[:at] + bytes([data[at] | 1]) + data[at + 1 :]


def with_foreign_member(data: bytes) -> bytes:
    out = BytesIO(data)
    with zipfile.ZipFile(out, "a") as archive:
        archive.writestr("notes.txt", "hello")
    return out.getvalue()


def with_standing_still(file: Path) -> None:
    motion = Demonstration.load(file)
    replace(motion, position_m=np.repeat(motion.position_m[:1], len(motion.position_m), 0)).save(file)


DAMAGE: dict[str, Callable[[Path], None]] = {
    "empty": rewritten(lambda data: b""),
    "cut": rewritten(lambda data: data[: len(data) // 2]),
    "no header": rewritten(lambda data: data[100:]),
    "encrypted": rewritten(lambda data: with_bit(with_bit(data, b"PK\x01\x02", 8), b"PK\x03\x04", 6)),
    "terabytes": rewritten(claiming_terabytes),
    "a foreign member": rewritten(with_foreign_member),
    "a text": rewritten(lambda data: b"hello"),
    "milliseconds": lambda file: replace(Demonstration.load(file), time_s=1e3 * Demonstration.load(file).time_s).save(file),
    "a mirror": rewritten(lambda data: _with_array(data, "frame_rotation", np.diag([1.0, -1.0])[None])),
    "nothing moves": with_standing_still,
    "of another task": lambda file: replace(Demonstration.load(file), frame_names=("valve",)).save(file),
    "missing": lambda file: file.unlink(),
    "a folder": lambda file: (file.unlink(), file.mkdir(), None)[2],
}  # fmt: skip


def _with_array(data: bytes, name: str, array: np.ndarray) -> bytes:
    out = BytesIO()
    with np.load(BytesIO(data)) as archive:
        np.savez(out, **{**archive, name: array})
    return out.getvalue()


@pytest.mark.parametrize("damage", DAMAGE)
@pytest.mark.parametrize("number", [0, 2])
def test_a_damaged_demonstration_is_set_aside_and_named_and_the_others_count(
    tmp_path: Path, damage: str, number: int
):
    files = taught(tmp_path)
    DAMAGE[damage](files[number])
    library = TaskLibrary(TASK, tmp_path)
    (fault,) = library.faults
    assert files[number].name in fault and "\n" not in fault
    assert len(library.demonstrations) == 2 and library.learned is not None
    assert load(tmp_path / TASK.name / "newest.farhand") == library.learned.model
    assert all(file.exists() for k, file in enumerate(files) if k != number)
    assert damage == "missing" or files[number].with_name(files[number].name + ".damaged").exists()
    again = TaskLibrary(TASK, tmp_path)
    assert not again.faults and again.learned is not None
    assert again.learned.sha256 == library.learned.sha256


LISTS = {
    "one byte that is no UTF-8": rewritten(
        lambda data: data.replace(b"demonstration", b"d\xffmonstration", 1)
    ),
    "empty": rewritten(lambda data: b""),
    "cut": rewritten(lambda data: data[:-20]),
    "deep": rewritten(lambda data: b"[" * 100_000),
    "another schema": rewritten(lambda data: data.replace(b'"schema": 1', b'"schema": 9')),
    "a name outside": rewritten(lambda data: data.replace(b'"demonstration', b'"../demonstration', 1)),
    "a revision that is not listed": rewritten(lambda data: data.replace(b'"current": 3', b'"current": 7')),
    "no date": rewritten(lambda data: data.replace(b'"made": "2', b'"made": "x2', 1)),
}


@pytest.mark.parametrize("damage", LISTS)
def test_a_damaged_list_is_set_aside_and_what_lies_in_the_folder_can_be_gone_back_to(
    tmp_path: Path, damage: str
):
    files, index = taught(tmp_path), tmp_path / TASK.name / "library.json"
    before = TaskLibrary(TASK, tmp_path).learned
    LISTS[damage](index)
    content = index.read_bytes()
    library = TaskLibrary(TASK, tmp_path)
    (fault,) = library.faults
    assert "library.json" in fault and "3 demonstrations" in fault and "\n" not in fault
    assert library.learned is None and index.with_suffix(".unreadable").read_bytes() == content
    assert all(file.exists() for file in files)
    library.go_to(1)
    assert library.learned is not None and before is not None and library.learned.sha256 == before.sha256


@pytest.mark.parametrize("content", [b"", b"\n", b"{}", b"\xff\xfe", b"[1, 2]\n[3]\n", b"[" * 100_000])
def test_samples_under_way_that_are_not_understood_are_none(tmp_path: Path, content: bytes):
    files = taught(tmp_path)
    files[0].with_name("under-way.jsonl").write_bytes(content)
    library = TaskLibrary(TASK, tmp_path)
    assert library.left_over is None and len(library.demonstrations) == 3


# A disk that is full or read-only ---------------------------------------------------------------


@pytest.fixture
def full(monkeypatch: pytest.MonkeyPatch) -> Callable[[], None]:
    def fail(_descriptor: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    return lambda: monkeypatch.setattr(os, "fsync", fail)


def test_all_samples_are_learned_though_none_can_be_kept(tmp_path: Path, full: Callable[[], None]):
    library = TaskLibrary(TASK, tmp_path)
    full()
    with pytest.raises(NotSaved, match=r"kept in memory only.*No space left"):
        library.learn(sample_strokes(TASK))
    assert len(library.demonstrations) == 3 and library.learned is not None
    assert library.learned.model.n_demonstrations == 3


@pytest.mark.parametrize("what", ["undo", "anew", "go to", "end"])
def test_what_was_asked_is_done_in_memory_and_then_it_is_said(
    tmp_path: Path, full: Callable[[], None], what: str
):
    taught(tmp_path)
    library = TaskLibrary(TASK, tmp_path)
    library.record(FRAMES)
    for point, time_s in zip(*stroke(), strict=True):
        library.hand(point, float(time_s))
    if what != "end":
        library.undo()
    full()
    done = {
        "undo": library.undo,
        "anew": library.start_anew,
        "go to": lambda: library.go_to(1),
        "end": library.end,
    }
    with pytest.raises(NotSaved):
        done[what]()
    assert len(library.demonstrations) == {"undo": 2, "anew": 0, "go to": 1, "end": 4}[what]
    assert (library.learned is None) == (what == "anew")


def test_a_start_on_a_full_disk_begins_with_what_was_taught_and_says_so(
    tmp_path: Path, full: Callable[[], None]
):
    taught(tmp_path)
    full()
    library = TaskLibrary(TASK, tmp_path)
    (fault,) = library.faults
    assert "kept in memory only" in fault and "empty" not in fault and len(library.demonstrations) == 3


def test_samples_are_one_revision_and_leave_those_before_alone(tmp_path: Path):
    library = TaskLibrary(TASK, tmp_path)
    library.learn(sample_strokes(TASK))
    assert [len(r.demonstrations) for r in library.revisions] == [3]
