"""The camera's own process, started by `camera_process.py`. It answers each request with a picture, or a fault.

It is started with its set-up on the standard input, and ends with it. A slow, crashing or hanging camera thus costs the
robot nothing.
"""

from __future__ import annotations

import os
import sys
from typing import BinaryIO, NamedTuple

import msgspec
import numpy as np

from farhand.common.arm.cell import Cell
from farhand.common.errors import FarhandError
from farhand.common.parent_process import end_with_parent
from farhand.common.task import AnyTask
from farhand.remote_site.camera.still import Still, make_still
from farhand.remote_site.config import RemoteConfig
from farhand.remote_site.interface.camera import Camera, SceneCamera, check_image
from farhand.remote_site.interface.driver import Closable, Startable, call_all

MOST_FRAME_BYTES = 1 << 20
LENGTH_BYTES = 4
_NICENESS = 5
MOST_TEXT = 200

_Pose = tuple[float, float, float, float, float, float, float]


class Setup(NamedTuple):
    """Set-up of a camera.

    Args:
        parent_pid: Process that started it.
        config: Name and options of the camera.
        task: The first task.
        cell: Arm in front of its receptacle; None for a point.
    """

    parent_pid: int
    config: RemoteConfig
    task: AnyTask
    cell: Cell | None


class Wanted(msgspec.Struct, frozen=True):
    """Request for a picture.

    Args:
        most_bytes: Largest size of the file [B].
        joints_rad: Joint angles of the arm; empty for none [rad].
        truth: True pose of a simulated receptacle; None for none.
        seen: Pose of the receptacle as the robot sees it; None for none.
    """

    most_bytes: int
    joints_rad: tuple[float, ...] = ()
    truth: _Pose | None = None
    seen: _Pose | None = None


class Fault(msgspec.Struct, frozen=True, tag=True):
    """Reason why there is no picture.

    Args:
        text: Reason in words.
        lasting: True if another attempt cannot succeed.
    """

    text: str
    lasting: bool = False


SETUPS = msgspec.msgpack.Decoder(Setup)
REQUESTS = msgspec.msgpack.Decoder(Wanted)
ANSWERS = msgspec.msgpack.Decoder(Still | Fault)
ENCODER = msgspec.msgpack.Encoder()


def framed(data: bytes) -> bytes:
    """Return a message with its length before it."""
    return len(data).to_bytes(LENGTH_BYTES, "big") + data


def length_of(frame: bytes) -> int:
    """Return the length that the beginning of a framed message tells."""
    return int.from_bytes(frame[:LENGTH_BYTES], "big")


def read_frame(stream: BinaryIO) -> bytes | None:
    """Return the next message of a stream; None at its end."""
    head = stream.read(LENGTH_BYTES)
    if len(head) < LENGTH_BYTES:
        return None
    n_bytes = length_of(head)
    data = stream.read(n_bytes) if n_bytes <= MOST_FRAME_BYTES else b""
    return data if len(data) == n_bytes else None


def open_camera(setup: Setup) -> Camera:
    """Make and start the configured camera.

    Raises:
        FarhandError: When it cannot be made.
    """
    from farhand.remote_site.robots.installed import CAMERA, make_driver

    if not setup.config.camera.use:
        # Imported here: another camera needs no physics.
        from farhand.remote_site.camera.simulated_camera import SimulatedCamera

        assert setup.cell is not None, "the simulated camera is that of an arm"
        return SimulatedCamera(setup.cell)
    camera = make_driver(CAMERA, setup.config, setup.task, setup.cell)
    _start(camera)
    return camera


def _start(camera: object) -> None:
    if isinstance(camera, Startable):
        camera.start()


def take(camera: Camera, wanted: Wanted) -> Still | Fault:
    """Take a picture; whatever the camera raises or returns instead is a fault."""
    try:
        if isinstance(camera, SceneCamera) and wanted.truth is not None:
            camera.show(np.array(wanted.joints_rad), np.array(wanted.truth))
        image = camera.capture()
        if image is None:
            return Fault("the camera has no image yet")
        check_image(image)
        return make_still(image, None if wanted.seen is None else np.array(wanted.seen), wanted.most_bytes)
    except Exception as error:
        return Fault(in_short(error))


def in_short(error: Exception) -> str:
    """Return an error on one short line."""
    words = str(error) if isinstance(error, FarhandError) else f"{type(error).__name__}: {error}"
    return " ".join(words.split())[:MOST_TEXT]


def main() -> None:
    """Answer requests from the standard input on the standard output until the input ends."""
    # Only answers may go there, whatever the camera's libraries print.
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    requests = sys.stdin.buffer
    if (data := read_frame(requests)) is None:
        return
    setup = SETUPS.decode(data)
    end_with_parent(setup.parent_pid)
    os.nice(_NICENESS)  # the control loop comes first

    def say(answer: Still | Fault) -> None:
        answers.write(framed(ENCODER.encode(answer)))
        answers.flush()

    from farhand.common.arm.simulation.rendering import RenderingUnavailable

    try:
        camera = open_camera(setup)
    except Exception as error:
        read_frame(requests)
        say(Fault(in_short(error), lasting=isinstance(error, RenderingUnavailable)))
        return
    try:
        while (data := read_frame(requests)) is not None:
            say(take(camera, REQUESTS.decode(data)))
    finally:
        if isinstance(camera, Closable):
            call_all([camera.close])
