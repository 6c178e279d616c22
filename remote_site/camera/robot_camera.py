"""Pictures for the sites that look at them: each taken when the link has room for it, and the newest only.

It needs nothing of the control loop but its reports, and runs in a thread of its own.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from functools import partial
from typing import Protocol

import numpy as np
from msgspec import UNSET
from numpy.typing import NDArray

from farhand.common.clock import BootClock
from farhand.common.errors import InvalidMessage
from farhand.common.link.interface import Link, Request
from farhand.common.log import loop_logger
from farhand.common.wire import keys
from farhand.common.wire.codec import decode, encode
from farhand.common.wire.messages import CameraPicture, CameraReply, CameraRequest, Stamp, Telemetry
from farhand.common.wire.reasons import Code, because
from farhand.remote_site.camera.picture_plan import LAPSES_S, CameraFailed, Fit, PicturePlan
from farhand.remote_site.camera.process import Wanted
from farhand.remote_site.camera.still import Still

_log = loop_logger(__name__)

Array = NDArray[np.float64]


class Shutter(Protocol):
    """Interface of the camera that takes the pictures."""

    def take(self, wanted: Wanted) -> Still:
        """Take a picture; may take seconds.

        Raises:
            CameraFailed: When there is none.
        """
        ...

    def interrupt(self) -> None:
        """Make the present picture fail, and begin no other; from any thread."""
        ...

    def close(self) -> object:
        """Close the camera, in the thread that takes the pictures."""
        ...


class RobotCamera:
    """Camera of a robot behind its link.

    Args:
        link: Link to the operators.
        clock: Clock of the robot.
        rate_bps: Configured capacity of the link [bit/s]; 0: more than enough.
        shutter: Takes the pictures; None for a robot without a camera.
        now_s: Clock of the periods [s].
    """

    def __init__(
        self,
        link: Link,
        clock: BootClock,
        rate_bps: float,
        shutter: Shutter | None,
        now_s: Callable[[], float] = time.monotonic,
    ):
        self._link, self._clock, self._shutter, self._now_s = link, clock, shutter, now_s
        self._plan, self._seq = PicturePlan(rate_bps), 0
        self._newest: tuple[Telemetry, Array | None] | None = None
        self._changed, self._closed = threading.Condition(), False
        link.serve(keys.CAMERA, partial(self._on_request, CameraRequest))
        self._thread = threading.Thread(target=self._run, name="camera", daemon=True)

    def start(self) -> None:
        """Start to take pictures, whenever somebody looks. Without a camera each request is answered with that reason."""
        if self._shutter is not None:
            self._thread.start()

    def observe(self, report: Telemetry, receptacle: Array | None) -> None:
        """Take the robot's newest report, with the true pose of a simulated receptacle. Called by the control loop; never blocks."""
        self._newest = report, receptacle

    def close(self) -> None:
        """End the thread and the camera's process."""
        with self._changed:
            self._closed = True
            self._changed.notify()
        if self._shutter is not None:
            self._shutter.interrupt()
        if self._thread.is_alive():
            self._thread.join(timeout=10.0)

    # The link's threads -------------------------------------------------------------------------

    def _on_request(self, kind: type[CameraRequest], request: Request) -> bool:
        try:
            asked = decode(request.data, kind)
        except InvalidMessage as error:
            _log.warning("not answered: %s", error)
            return False
        request.answer(encode(self._reply(asked)))
        return True

    def _reply(self, asked: CameraRequest) -> CameraReply:
        stamp = self._stamp()
        if self._shutter is None:
            return CameraReply(sends=False, reason=because(Code.NO_CAMERA), stamp=stamp)
        with self._changed:
            now_s = self._now_s()
            self._plan.asked(asked, now_s)
            self._changed.notify()
            return CameraReply(sends=self._plan.sends(now_s), reason=self._plan.why_none(now_s), stamp=stamp)

    def _stamp(self) -> Stamp:
        return Stamp(self._clock.boot, self._clock.now_ns())

    # The camera's thread ------------------------------------------------------------------------

    def _run(self) -> None:
        assert self._shutter is not None
        while (fit := self._next()) is not None:
            began_s = self._now_s()
            try:
                self.take(fit)
            except CameraFailed as error:
                self._note(error)
            except Exception as error:
                _log.exception("a picture could not be sent")
                self._note(CameraFailed(f"{type(error).__name__}: {error}"))
            else:
                with self._changed:
                    self._plan.sent(fit, began_s)
        self._shutter.close()

    def _next(self) -> Fit | None:
        """Return the size of the next picture when it is due; None at the end."""
        with self._changed:
            while not self._closed:
                fit, wait_s = self._plan.due(self._now_s())
                if fit is not None and self._newest is not None:
                    return fit
                self._changed.wait(wait_s or LAPSES_S)
        return None

    def _note(self, error: CameraFailed) -> None:
        with self._changed:
            if not self._closed:
                _log.warning("no picture: %s", error)
                self._plan.failed(error, self._now_s())

    def take(self, fit: Fit) -> None:
        """Take and send one picture.

        Raises:
            CameraFailed: When there is none.
        """
        assert self._shutter is not None and self._newest is not None
        report, truth = self._newest
        stamp = self._stamp() if truth is None else report.stamp
        still = self._shutter.take(_wanted(report, truth, fit))
        exposed = Stamp(stamp.boot, max(0, stamp.t_ns - round(1e9 * still.age_s)))
        self._seq += 1
        picture = CameraPicture(
            seq=self._seq, stamp=exposed, taken_s=1e-9 * max(0, self._clock.now_ns() - exposed.t_ns), width_px=still.width_px, height_px=still.height_px, jpeg=still.jpeg,
            view=still.view,
        )  # fmt: skip
        self._link.send(keys.PICTURE, encode(picture))


def _wanted(report: Telemetry, truth: Array | None, fit: Fit) -> Wanted:
    joints = report.arm.joints_rad if report.arm is not UNSET else ()
    seen = _pose(report) if len(report.position_m) == 3 else None
    return Wanted(fit.most_bytes, joints, None if truth is None else tuple(truth.tolist()), seen)


def _pose(report: Telemetry) -> tuple[float, float, float, float, float, float, float]:
    """Return the task frame as the robot sees it."""
    from scipy.spatial.transform import Rotation

    rotation = Rotation.from_rotvec(report.frame_rotation_rad or (0.0, 0.0, 0.0))
    w, x, y, z = rotation.as_quat(scalar_first=True).tolist()
    px, py, pz = report.frame_origin_m
    return px, py, pz, w, x, y, z
