"""Files are written whole, where links lead, with the mode that belongs to them; their faults are named."""

from __future__ import annotations

import errno
import os
import select
import signal
import stat
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from farhand.common import whole_file
from farhand.common.errors import InvalidConfiguration, InvalidDemonstration, InvalidModel
from farhand.common.whole_file import Claim, FolderInUse, fault_of, read_whole, write_whole
from farhand.deploy.entry import ROOT


def mode(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


@pytest.mark.parametrize("mask", [0o022, 0o077, 0o002])
def test_a_new_file_has_the_mode_of_the_umask(tmp_path: Path, mask: int):
    before = os.umask(mask)
    try:
        write_whole(tmp_path / "a", b"new")
    finally:
        os.umask(before)
    assert mode(tmp_path / "a") == 0o666 & ~mask and (tmp_path / "a").read_bytes() == b"new"


@pytest.mark.parametrize("old", [0o600, 0o644, 0o640, 0o755])
def test_an_old_file_keeps_its_mode(tmp_path: Path, old: int):
    (tmp_path / "a").write_bytes(b"old")
    (tmp_path / "a").chmod(old)
    write_whole(tmp_path / "a", b"new")
    assert mode(tmp_path / "a") == old and (tmp_path / "a").read_bytes() == b"new"
    assert [file.name for file in tmp_path.iterdir()] == ["a"]


def test_links_stay_links_and_what_they_lead_to_is_written(tmp_path: Path):
    (tmp_path / "far").mkdir()
    (tmp_path / "near").symlink_to("middle")
    (tmp_path / "middle").symlink_to(tmp_path / "far" / "file")
    for content in (b"a link to nothing yet", b"and again"):
        write_whole(tmp_path / "near", content)
        assert (tmp_path / "far" / "file").read_bytes() == content
    assert (tmp_path / "near").is_symlink() and (tmp_path / "middle").is_symlink()


def test_a_device_is_written_into_and_stays_one(tmp_path: Path):
    write_whole("/dev/null", b"x" * 100_000)
    assert stat.S_ISCHR(os.stat("/dev/null").st_mode)
    (tmp_path / "null").symlink_to("/dev/null")
    write_whole(tmp_path / "null", b"x")
    assert stat.S_ISCHR(os.stat("/dev/null").st_mode) and (tmp_path / "null").is_symlink()


def test_a_full_device_is_an_error_under_its_name(tmp_path: Path):
    with pytest.raises(OSError) as caught:
        write_whole("/dev/full", b"x" * 100_000)
    assert (caught.value.errno, caught.value.filename) == (errno.ENOSPC, "/dev/full")


def test_a_pipe_is_written_into_when_somebody_reads_and_an_error_when_nobody_does(tmp_path: Path):
    pipe, got, data = tmp_path / "pipe", list[bytes](), bytes(range(256)) * 2000
    os.mkfifo(pipe)
    with pytest.raises(OSError) as caught:
        write_whole(pipe, data)
    assert caught.value.filename == str(pipe)
    reading = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)

    def read() -> None:
        select.select([reading], [], [])
        os.set_blocking(reading, True)
        with os.fdopen(reading, "rb") as file:
            got.append(file.read())

    reader = threading.Thread(target=read)
    reader.start()
    write_whole(pipe, data)
    reader.join()
    assert got == [data] and stat.S_ISFIFO(pipe.stat().st_mode)


@pytest.mark.parametrize("where", ["nowhere/a", "folder", "file/a", "x" * 300])
def test_errors_name_the_file_as_it_was_given_and_leave_nothing_behind(
    tmp_path: Path, where: str, monkeypatch: pytest.MonkeyPatch
):
    (tmp_path / "folder").mkdir()
    (tmp_path / "file").write_bytes(b"")
    before = set(tmp_path.rglob("*"))
    monkeypatch.chdir(tmp_path)
    with pytest.raises(OSError) as caught:
        write_whole(where, b"data")
    assert caught.value.filename == where and set(tmp_path.rglob("*")) == before


def test_a_write_that_fails_in_the_middle_leaves_the_old_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    (tmp_path / "a").write_bytes(b"old")

    def full(_descriptor: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space left"):
        write_whole(tmp_path / "a", b"new")
    assert (tmp_path / "a").read_bytes() == b"old" and [f.name for f in tmp_path.iterdir()] == ["a"]


# Reading ----------------------------------------------------------------------------------------


def test_a_file_or_a_pipe_is_read_and_more_than_asked_for_is_not(tmp_path: Path):
    (tmp_path / "a").write_bytes(b"x" * 3_000_000)
    assert len(read_whole(tmp_path / "a")) == 3_000_000
    for path, most in ((tmp_path / "a", 1000), (Path("/dev/zero"), 5_000_000)):
        with pytest.raises(OSError, match="larger than"):
            read_whole(path, most)
    receive, send = os.pipe()
    os.write(send, b"from a pipe")
    os.close(send)
    assert read_whole(f"/dev/fd/{receive}") == b"from a pipe"
    os.close(receive)


def test_a_pipe_that_nobody_writes_is_given_up_and_a_folder_is_no_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(whole_file, "_PATIENCE_MS", 50)
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(OSError, match="nothing came"):
        read_whole(tmp_path / "pipe")
    with pytest.raises(IsADirectoryError):
        read_whole(tmp_path)


@pytest.mark.parametrize(
    "fault",
    [
        ValueError("a\nb"), RuntimeError("encrypted"), MemoryError(), RecursionError("deep"), KeyError("x"), EOFError(),
        NotImplementedError("method 99"), UnicodeDecodeError("utf-8", b"\xff", 0, 1, "bad"), OverflowError("large"),
        FileNotFoundError(errno.ENOENT, "No such file"), InvalidModel("inner", "means", "numbers"), AssertionError(),
    ],
    ids=lambda fault: type(fault).__name__,
)  # fmt: skip
@pytest.mark.parametrize("invalid", [InvalidDemonstration, InvalidConfiguration])
def test_whatever_fails_while_a_file_is_read_is_one_error_of_one_line_with_its_name(fault, invalid):
    with pytest.raises(invalid) as caught, fault_of("some/file", invalid, "a good file"):
        raise fault
    assert str(caught.value).startswith("some/file: ") and "\n" not in str(caught.value)


@pytest.mark.parametrize("end", [KeyboardInterrupt, SystemExit])
def test_what_is_no_fault_of_the_file_passes(end: type[BaseException]):
    with pytest.raises(end), fault_of("file", InvalidModel, "a model"):
        raise end


def test_a_name_with_line_feeds_is_told_in_one_line():
    error = InvalidModel("a\nb\u202e\udcff", "x\r", "a model")
    assert str(error) == "a\\nb\\u202e\\udcff: x\\r: a model"


# One owner -------------------------------------------------------------------------------------


def test_a_folder_is_claimed_once_and_again_when_it_was_given_up(tmp_path: Path):
    first = Claim(tmp_path / "new" / "folder", "its files")
    with pytest.raises(FolderInUse, match=rf"folder: process {os.getpid()} keeps its files .*--data-dir"):
        Claim(tmp_path / "new" / "folder", "its files")
    Claim(tmp_path / "new", "another folder")
    first.release()
    second = Claim(tmp_path / "new" / "folder", "its files")
    del second
    Claim(tmp_path / "new" / "folder", "its files")


def test_a_folder_that_cannot_be_written_needs_no_claim(tmp_path: Path):
    (tmp_path / "file").write_bytes(b"")
    for _ in range(2):
        Claim(tmp_path / "file" / "folder", "its files")


def test_a_claim_on_a_disk_without_room_holds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    def no_room(*_: object) -> int:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "pwrite", no_room)
    claim = Claim(tmp_path, "what was taught")
    with pytest.raises(FolderInUse, match="process unknown keeps what was taught there"):
        Claim(tmp_path, "what was taught")
    claim.release()


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_a_claim_ends_with_its_process_however_that_ends(tmp_path: Path, number: signal.Signals):
    words = (
        f"import sys, time; sys.path.insert(0, {ROOT!r}); from pathlib import Path\n"
        f"from farhand.common.whole_file import Claim\nclaim = Claim(Path({str(tmp_path)!r}), 'x')\n"
        "print('claimed', flush=True); time.sleep(600)"
    )
    with subprocess.Popen([sys.executable, "-c", words], stdout=subprocess.PIPE, text=True) as owner:
        assert owner.stdout is not None and owner.stdout.readline() == "claimed\n"
        with pytest.raises(FolderInUse, match=f"process {owner.pid} keeps"):
            Claim(tmp_path, "x")
        owner.send_signal(number)
        owner.wait()
    Claim(tmp_path, "x").release()
