"""The camera's own process: whatever it does, the robot's process has a picture or a reason in words, and goes on."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path

import pytest
from PIL import Image

from farhand.remote_site.camera.camera_process import CameraProcess
from farhand.remote_site.camera.picture_plan import CameraFailed
from farhand.remote_site.camera.process import Wanted
from tests.remote_site.camera.cameras import camera, put_camera

WANTED = Wanted(most_bytes=2500)


@pytest.fixture(autouse=True)
def own_cameras(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    put_camera(tmp_path)


@pytest.fixture
def working() -> Iterator[CameraProcess]:
    process = camera("work")
    yield process
    process.close()


def why(process: CameraProcess) -> str:
    with pytest.raises(CameraFailed) as failed:
        process.take(WANTED)
    process.close()
    assert not failed.value.lasting
    return str(failed.value)


def test_a_camera_of_ones_own_gives_jpeg_files_whatever_it_prints_and_is_replaced_when_it_was_killed(
    working: CameraProcess,
):
    still = working.take(WANTED)
    assert Image.open(BytesIO(still.jpeg)).size == (still.width_px, still.height_px) == (160, 90)
    assert still.age_s == 0.25 and still.view is None and len(still.jpeg) <= 2500
    first = working.pid
    assert first is not None
    os.kill(first, signal.SIGKILL)
    with pytest.raises(CameraFailed, match="the camera's process was ended by signal 9"):
        working.take(WANTED)
    assert working.take(WANTED).jpeg == still.jpeg and working.pid != first


@pytest.mark.parametrize("name", ["farhand/__init__.py", "farhand.py", "remote_site/__init__.py", "queue.py"])
def test_a_package_of_our_name_that_stands_in_a_users_folder_is_not_run(
    tmp_path: Path, name: str, working: CameraProcess, monkeypatch: pytest.MonkeyPatch
):
    (tmp_path / name).parent.mkdir(exist_ok=True)
    (tmp_path / name).write_text("raise SystemExit('foreign code')\n")
    if name == "queue.py":  # a standard module's name: in the working directory alone
        monkeypatch.setenv("PYTHONPATH", str(tmp_path / "drivers"))
        (tmp_path / "drivers").mkdir()
        put_camera(tmp_path / "drivers")
        monkeypatch.chdir(tmp_path)
    assert working.take(WANTED).jpeg


@pytest.mark.parametrize(
    ("does", "words"),
    [
        ("raise", "RuntimeError: the cable is unplugged"),
        ("die", "the camera's process ended with status 3"),
        ("refuse", "ValueError: no such device: /dev/video7"),
        ("nothing", "the camera has no image yet"),
        ("list", "camera: capture: a CameraImage or None, got list"),
        ("grey", r"camera: capture: pixels: uint8 of shape (height, width, 3), got uint8 of shape (90, 160)"),
        ("floats", r"camera: capture: pixels: uint8 of shape (height, width, 3), got float64 of shape (90, 160, 3)"),
        ("old", "camera: capture: age_s: seconds, zero or more, got nan"),
    ],
)  # fmt: skip
def test_a_camera_that_fails_is_told_in_its_own_words(does: str, words: str):
    assert words in why(camera(does))


def test_a_camera_that_cannot_be_imported_is_told_with_its_entry_point():
    assert "camera 'missing' (no_such_module:Camera) cannot be imported" in why(camera("work", use="missing"))


def test_a_camera_that_hangs_is_ended():
    process = camera("hang", answer_s=0.5)
    process._start_s = 3.0
    assert why(process) == "the camera did not answer for 3 s: its process was ended"
    assert process.pid is None


def test_an_interrupt_from_another_thread_ends_a_picture_that_is_being_taken():
    process = camera("hang")
    told: list[CameraFailed] = []

    def take() -> None:
        try:
            process.take(WANTED)
        except CameraFailed as error:
            told.append(error)
        process.close()

    thread = threading.Thread(target=take)
    thread.start()
    while process.pid is None:
        thread.join(timeout=0.01)
    process.interrupt()
    thread.join(timeout=30.0)
    assert not thread.is_alive() and len(told) == 1
    assert why(process) == "the camera is closed"
