"""Checks of an arm's driver, joint by joint, and of a camera; public as `farhand.testing`."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from farhand.common.arm.robot_file import RobotFile
from farhand.remote_site.interface.arm_driver import ArmDriver, ArmReading, check_reading
from farhand.remote_site.interface.camera import Camera, check_image
from farhand.remote_site.interface.driver import Haltable
from farhand.testing.findings import check_times, findings, opened

Array = NDArray[np.float64]
Pace = Callable[[float], object]

_REST_RAD_S = 0.01
_SLOW = 0.2
"""Speed of the check, as a share of each joint's limit."""
_SETTLE_S, _SILENCE_S, _WATCHED_S = 0.5, 0.4, 0.1
_CAPTURE_S = 5.0


def check_arm(
    driver: ArmDriver,
    robot: RobotFile,
    *,
    room_rad: float = 0.05,
    dt_s: float = 0.01,
    pace: Pace = time.sleep,
) -> None:
    """Check an arm's driver: form, order, signs and units of its joints, standing, halting, and what it does in silence.

    Each joint in turn goes forth and back, slowly.

    Args:
        driver: Driver that has not been started; it is started, halted and closed as far as it can be.
        robot: File of the robot.
        room_rad: Free way of each joint from its place in the positive direction [rad].
        dt_s: Control period [s].
        pace: Waits for the next period; `lambda _: None` lets a simulation run at once.

    Raises:
        AssertionError: With a line for each finding.
    """
    with findings("arm driver") as told, opened(driver, told, "read", "command"):
        trial = _ArmTrial(driver, robot, dt_s, pace, told)
        trial.reads()
        for joint in range(len(robot.joints)):
            trial.moves(joint, room_rad)
        trial.stands_in_silence(room_rad)
        trial.halts()
        trial.feels()
        check_times(told, trial.durations_s, dt_s)


def check_camera(
    camera: Camera, *, n_images: int = 3, period_s: float = 0.4, pace: Pace = time.sleep
) -> None:
    """Check a camera: form of its images, that they are copies, and how long one takes.

    Args:
        camera: Camera that has not been started; it is started and closed as far as it can be.
        n_images: Number of images to take.
        period_s: Time between two of them [s].
        pace: Waits for the next one.

    Raises:
        AssertionError: With a line for each finding.
    """
    with findings("camera") as told, opened(camera, told, "capture"):
        images, copies = [], []
        for _ in range(n_images):
            before_s = time.monotonic()
            image = camera.capture()
            if time.monotonic() - before_s > _CAPTURE_S:
                told.append(f"capture: it took more than {_CAPTURE_S:g} s: the picture counts as failed")
            if image is not None:
                check_image(image)
                images.append(image.pixels)
                copies.append(image.pixels.copy())
            pace(period_s)
        if not images:
            told.append("capture: it took no image: give it more time (n_images, period_s)")
        if not all(map(np.array_equal, images, copies)):
            told.append("capture: an image changes when the next one is taken: return copies")


class _ArmTrial:
    """Motions of an arm, in this order."""

    def __init__(self, driver: ArmDriver, robot: RobotFile, dt_s: float, pace: Pace, told: list[str]):
        self._driver, self._robot, self._dt_s, self._pace, self._told = driver, robot, dt_s, pace, told
        self._still = np.zeros(len(robot.joints))
        self._wrenches: list[Array] = []
        self.durations_s: list[float] = []

    def reads(self) -> None:
        self._read()
        self._do(self._still, _SETTLE_S)
        self._rests("at the beginning")

    def moves(self, joint: int, room_rad: float) -> None:
        """Move one joint forth and back, and compare its angle, its velocity, and the other joints."""
        name, speed = self._robot.joints[joint], _SLOW * self._robot.limits.velocity_rad_s[joint]
        duration_s = room_rad / speed
        velocities = self._still.copy()
        for sign, way in ((1.0, "forth"), (-1.0, "back")):
            began = self._read()
            kept, told_rad_s = began.joints_rad.copy(), []
            velocities[joint] = sign * speed
            for _ in range(max(1, round(duration_s / self._dt_s))):
                self._do(velocities, self._dt_s)
                told_rad_s.append(self._read().joint_velocities[joint])
            self._do(self._still, _SETTLE_S)
            if not np.array_equal(began.joints_rad, kept):
                self._told.append("read: a reading changes when the arm moves on: return copies")
            moved = self._read().joints_rad - kept
            if abs(moved[joint] - sign * room_rad) > 0.4 * room_rad:
                self._told.append(
                    f"command: {name} moved by {moved[joint]:.3f} rad where {sign * room_rad:.3f} was asked for, {way}"
                )
            others = np.delete(np.abs(moved), joint)
            if others.size and others.max() > 0.3 * room_rad:
                other = [each for each in self._robot.joints if each != name][int(others.argmax())]
                self._told.append(
                    f"command: {other} moved by {others.max():.3f} rad where {name} was to move: is the order the file's?"
                )
            middle = float(np.median(told_rad_s))
            if abs(middle - sign * speed) > 0.4 * speed:
                self._told.append(
                    f"read: joint_velocities: {name} at {middle:.3f} rad/s while it moved with {sign * speed:.3f}"
                )
            self._rests(f"after {name} moved {way}")

    def stands_in_silence(self, room_rad: float) -> None:
        """Leave off commanding in the middle of a motion."""
        velocities = self._still.copy()
        velocities[0] = _SLOW * self._robot.limits.velocity_rad_s[0]
        self._do(velocities, 0.25 * room_rad / velocities[0])
        self._pace(_SILENCE_S)
        before = self._read().joints_rad.copy()
        self._pace(_WATCHED_S)
        gone_rad = float(np.abs(self._read().joints_rad - before).max())
        if gone_rad > 0.3 * velocities[0] * _WATCHED_S:
            self._told.append(
                f"command: it moves on by {gone_rad:.3f} rad in {_WATCHED_S:g} s, {_SILENCE_S:g} s after the last command: hold one for 0.1 s at most"
            )
        self._do(self._still, _SETTLE_S)

    def halts(self) -> None:
        if isinstance(self._driver, Haltable):
            self._driver.halt()
            self._driver.halt()
            self._do(self._still, self._dt_s)
            self._rests("after halt")

    def feels(self) -> None:
        """Compare all wrenches: a sensor that says the same all the time does not measure."""
        if len(self._wrenches) > 1 and all(
            np.array_equal(each, self._wrenches[0]) for each in self._wrenches
        ):
            self._told.append(f"read: wrench: {self._wrenches[0].tolist()} all the time, whatever moves")

    def _read(self) -> ArmReading:
        reading = self._driver.read()
        check_reading(reading, len(self._robot.joints))
        self._wrenches.append(reading.wrench.copy())
        return reading

    def _do(self, joint_velocities: Array, duration_s: float) -> None:
        for _ in range(max(1, math.ceil(duration_s / self._dt_s - 1e-9))):
            before_s = time.perf_counter()
            self._driver.command(joint_velocities.copy(), self._dt_s)
            self._read()
            self.durations_s.append(time.perf_counter() - before_s)
            self._pace(self._dt_s)

    def _rests(self, when: str) -> None:
        fastest = float(np.abs(self._read().joint_velocities).max())
        if fastest > _REST_RAD_S:
            self._told.append(f"command: told to stand, {fastest:.3f} rad/s {when}")
