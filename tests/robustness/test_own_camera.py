"""A camera of one's own in a real robot's process: its pictures reach who looks, and its death touches nothing else."""

from __future__ import annotations

import os
import queue
import select
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from farhand.common.address import free_port
from farhand.common.wire import keys
from farhand.common.wire.codec import decode
from farhand.common.wire.messages import CameraPicture, CameraReply, CameraRequest
from farhand.evaluation.harness.farhand_process import HeardProcess
from tests.farhand_process import refusal, running
from tests.messages import said
from tests.remote_site.camera.cameras import put_camera
from tests.robustness.raw_operator import RawOperator

PATIENCE_S = 60.0


@contextmanager
def robot(folder: Path, *options: str) -> Iterator[tuple[HeardProcess, RawOperator]]:
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    with running("remote", f"--listen={endpoint}", f"--data-dir={folder / 'data'}", *options) as process:
        process.until("the robot is ready")
        operator = RawOperator(endpoint)
        try:
            yield process, operator
        finally:
            operator.close()


def look(operator: RawOperator) -> CameraReply:
    return operator.ask(keys.CAMERA, CameraRequest(session="the test"), CameraReply)


def camera_of(pid: int) -> list[int]:
    """Child processes of a robot."""
    files = Path(f"/proc/{pid}/task").glob("*/children")
    return [int(child) for file in files for child in file.read_text(encoding="ascii").split()]


def test_a_camera_that_dies_is_told_and_started_again_and_the_robot_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    put_camera(tmp_path)
    file = tmp_path / "remote.toml"
    file.write_text('[camera]\nuse = "mine"\noptions = { does = "work" }\n', encoding="utf-8")
    with robot(tmp_path, f"--config={file}") as (process, operator):
        pictures: queue.SimpleQueue[CameraPicture] = queue.SimpleQueue()
        operator.link.subscribe(keys.PICTURE, lambda data: pictures.put(decode(data, CameraPicture)))
        assert not camera_of(process.pid), "nobody has looked yet"
        assert look(operator).sends
        before = operator.report()
        picture = pictures.get(timeout=PATIENCE_S)
        assert picture.jpeg.startswith(b"\xff\xd8\xff") and (picture.width_px, picture.height_px) == (160, 90)
        assert picture.stamp.boot == before.stamp.boot and picture.view is None
        (camera,) = camera_of(process.pid)
        os.kill(camera, signal.SIGKILL)
        while "ended by signal 9" not in said(look(operator)):
            operator.report()
        while not pictures.empty():
            picture = pictures.get()
        look(operator)
        assert pictures.get(timeout=PATIENCE_S).seq > picture.seq
        assert operator.report().stamp.boot == before.stamp.boot
        (camera,) = camera_of(process.pid)
        process.send(signal.SIGTERM)
        assert process.wait() == 0, process.words
        assert not Path(f"/proc/{camera}").exists()


def test_a_robot_that_is_killed_leaves_no_camera_behind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    put_camera(tmp_path)
    file = tmp_path / "remote.toml"
    file.write_text('[camera]\nuse = "mine"\noptions = { does = "hang" }\n', encoding="utf-8")
    with robot(tmp_path, f"--config={file}") as (process, operator):
        look(operator)
        while not (cameras := camera_of(process.pid)):
            operator.report()
        os.kill(process.pid, signal.SIGKILL)
        process.wait()
        alive = os.pidfd_open(cameras[0]) if Path(f"/proc/{cameras[0]}").exists() else None
        if alive is not None:
            assert select.select([alive], [], [], PATIENCE_S)[0], "the camera outlives its robot"
            os.close(alive)


def test_a_camera_that_is_not_installed_ends_the_start_in_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    put_camera(tmp_path)
    line = refusal("remote", "--camera=yours", f"--listen=tcp/127.0.0.1:{free_port()}")
    assert "camera.use" in line and "mine, missing" in line and "'yours'" in line
