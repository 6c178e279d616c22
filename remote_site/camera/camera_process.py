"""Owner of the camera's process: starts it when the first picture is wanted, ends it when it does not answer."""

from __future__ import annotations

import contextlib
import os
import select
import subprocess
import sys
import threading
import time
from pathlib import Path

from farhand.common.arm.cell import Cell
from farhand.common.errors import InvalidMessage
from farhand.common.log import loop_logger
from farhand.common.task import AnyTask, ArmTask
from farhand.common.whole_file import fault_of
from farhand.remote_site.camera.picture_plan import CameraFailed
from farhand.remote_site.camera.process import (
    ANSWERS,
    ENCODER,
    LENGTH_BYTES,
    MOST_FRAME_BYTES,
    Fault,
    Setup,
    Wanted,
    framed,
    length_of,
)
from farhand.remote_site.camera.still import Still
from farhand.remote_site.config import RemoteConfig
from farhand.remote_site.robots.installed import NO_CAMERA

_log = loop_logger(__name__)

ANSWER_S, START_S = 5.0, 120.0
"""Longest time for a picture, and for the first one, with the start of the process [s]."""
_ENDING_S = 0.5
_PROGRAM = """import sys
sys.path.insert(0, sys.argv.pop())
import farhand
del sys.path[0]
from farhand.remote_site.camera.process import main
main()"""
"""Runs this very code: `-m` would take a package `farhand` of whatever folder PYTHONPATH names first."""
_ROOT = str(Path(__file__).parents[3])
"""Folder that holds the package."""


class CameraProcess:
    """Camera in a process of its own. Used by one thread, except `interrupt`.

    Args:
        setup: Set-up of the camera.
        answer_s: Longest time for a picture [s].
        start_s: Longest time for the first one [s].
    """

    def __init__(self, setup: Setup, answer_s: float = ANSWER_S, start_s: float = START_S):
        self._setup, self._answer_s, self._start_s = setup, answer_s, start_s
        self._process: subprocess.Popen[bytes] | None = None
        self._lock, self._interrupted = threading.Lock(), False

    @property
    def pid(self) -> int | None:
        """Id of the present process; None without one."""
        return self._process.pid if self._process is not None else None

    def take(self, wanted: Wanted) -> Still:
        """Take a picture; starts the process if none runs.

        Raises:
            CameraFailed: When there is no picture, with the reason.
        """
        patience_s = self._start_s if self._process is None else self._answer_s
        try:
            process = self._started()
            _write(process, ENCODER.encode(wanted))
            data = _answer(process, patience_s)
        except TimeoutError as error:
            self.close()
            silent = f"the camera did not answer for {patience_s:g} s: its process was ended"
            raise CameraFailed(silent) from error
        except OSError:
            data = None
        if data is None:
            status = self.close()
            how = f"was ended by signal {-status}" if status < 0 else f"ended with status {status}"
            raise CameraFailed(f"the camera's process {how}")
        try:
            with fault_of("picture", InvalidMessage, "a picture or a fault"):
                answer = ANSWERS.decode(data)
        except InvalidMessage as error:
            self.close()
            raise CameraFailed(f"the camera's process gave no picture ({error})") from error
        if isinstance(answer, Fault):
            raise CameraFailed(answer.text, answer.lasting)
        return answer

    def interrupt(self) -> None:
        """End the process for good: a picture that is being taken fails. From any thread."""
        with self._lock:
            self._interrupted = True
            if self._process is not None:
                self._process.kill()

    def close(self) -> int:
        """End the process, if one runs, and return its status. The next picture starts another one."""
        with self._lock:
            process, self._process = self._process, None
        if process is None:
            return 0
        for pipe in (process.stdin, process.stdout):
            if pipe is not None:
                with contextlib.suppress(OSError):  # what was still to be written
                    pipe.close()
        try:
            return process.wait(_ENDING_S)  # its input has ended
        except subprocess.TimeoutExpired:
            process.kill()
            return process.wait()

    def _started(self) -> subprocess.Popen[bytes]:
        """Return the running process, and start one if none runs."""
        if self._process is not None:
            return self._process
        with self._lock:
            if self._interrupted:
                raise CameraFailed("the camera is closed")
            self._process = process = subprocess.Popen(
                [sys.executable, "-P", "-c", _PROGRAM, _ROOT],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                # The drawing library would take every processor.
                env={**os.environ, "LP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
                start_new_session=True,  # Ctrl-C in the terminal is for the robot's process
            )
        _write(process, ENCODER.encode(self._setup))
        return process


def camera_of(config: RemoteConfig, task: AnyTask, cell: Cell | None) -> CameraProcess | None:
    """Return the configured camera; None for none. Without a choice the simulated arm alone has one.

    Args:
        config: Name and options of the camera.
        task: The first task.
        cell: Arm in front of its receptacle; None for a point.
    """
    name = config.camera.use
    is_simulated_arm = isinstance(task, ArmTask) and not config.arm_driver.use
    if name == NO_CAMERA or not (name or is_simulated_arm):
        return None
    return CameraProcess(Setup(os.getpid(), config, task, cell))


def _write(process: subprocess.Popen[bytes], data: bytes) -> None:
    assert process.stdin is not None
    process.stdin.write(framed(data))
    process.stdin.flush()


def _answer(process: subprocess.Popen[bytes], patience_s: float) -> bytes | None:
    """Return the next answer; None when the process has ended.

    Raises:
        TimeoutError: When it was silent for too long.
    """
    assert process.stdout is not None
    until_s, fd, data = time.monotonic() + patience_s, process.stdout.fileno(), b""
    while len(data) < LENGTH_BYTES or len(data) < LENGTH_BYTES + length_of(data) <= MOST_FRAME_BYTES:
        ready, _, _ = select.select([fd], [], [], max(0.0, until_s - time.monotonic()))
        if not ready:
            raise TimeoutError
        if not (more := os.read(fd, 1 << 16)):
            return None
        data += more
    return data[LENGTH_BYTES:]
