"""What lies in the runtime folder, or answers there, is at most one process that is not understood."""

from __future__ import annotations

import os
import socket
import threading
from collections.abc import Callable
from pathlib import Path

import pytest

from farhand.deploy import process_discovery
from farhand.deploy.process_discovery import MAX_BYTES, find_processes, forget_ended, short_address

ANSWERS = {
    "no text": b'{"role": "robot\xff"}',
    "bytes": b"\xff\x00",
    "deep": b"[" * 60_000,
    "another form": b'{"role": "robot"}',
    "no JSON": b"HTTP/1.1 200 OK\r\n\r\n",
    "far too much": b"x" * (3 * MAX_BYTES),
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("FARHAND_RUNTIME_DIR", str(tmp_path))
    return tmp_path


@pytest.mark.parametrize("answer", ANSWERS)
def test_whatever_answers_in_place_of_a_process_is_told_as_foreign(folder: Path, answer: str):
    path = folder / "robot-rov1-12"
    with socket.socket(socket.AF_UNIX) as listener:
        with short_address(path) as address:
            listener.bind(address)
        listener.listen()

        def serve() -> None:
            asking, _ = listener.accept()
            with asking:
                try:
                    asking.sendall(ANSWERS[answer])
                except OSError:
                    return  # it has heard enough

        server = threading.Thread(target=serve)
        server.start()
        (found,) = find_processes()
        server.join()
    assert (found.role, found.name, found.pid, found.fault) == ("robot", "rov1", 12, "foreign")


@pytest.mark.parametrize("mode", [0o777, 0o770])
def test_a_folder_that_others_may_write_is_not_read(folder: Path, mode: int):
    (folder / "robot-rov1-12.ended").write_text('{"pid":12,"code":"failed","text":"a lie","at_s":1.0}')
    assert [found.pid for found in find_processes()] == [12]
    folder.chmod(mode)
    assert not find_processes()
    forget_ended()
    assert list(folder.iterdir())


def test_who_accepts_and_says_nothing_is_told_as_silent(folder: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(process_discovery, "ANSWER_S", 0.05)
    with socket.socket(socket.AF_UNIX) as listener:
        with short_address(folder / "robot-rov1-12") as address:
            listener.bind(address)
        listener.listen()
        (found,) = find_processes()
    assert found.fault == "silent"


LAST_WORDS: dict[str, Callable[[Path], object]] = {
    "no text": lambda file: file.write_bytes(b'{"text": "\xff"}'),
    "empty": lambda file: file.write_bytes(b""),
    "deep": lambda file: file.write_bytes(b"[" * 60_000),
    "vast": lambda file: file.write_bytes(b"[" + b" " * 10_000_000),
    "a folder": Path.mkdir,
    "a pipe": os.mkfifo,
    "a link to nothing": lambda file: file.symlink_to("nowhere"),
}


@pytest.mark.parametrize("words", LAST_WORDS)
def test_last_words_that_are_not_understood_are_none_and_stay(
    folder: Path, words: str, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr("farhand.common.whole_file._PATIENCE_MS", 50)  # a pipe that nobody writes
    LAST_WORDS[words](folder / "robot-rov1.ended")
    (folder / "link-link.ended").write_bytes(
        b'{"pid": 1, "code": "failed", "text": "it said so", "at_s": 0.0}'
    )
    (found,) = find_processes()
    assert found.role == "link" and found.words is not None
    forget_ended()
    assert [file.name for file in folder.iterdir()] == ["robot-rov1.ended"]
