"""`farhand.testing` on arms and cameras: the shipped ones are sound, and each fault of another one is named."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from farhand.common.arm.simulation.disturbances import Surroundings
from farhand.common.arm.simulation.simulation import TICK_S, Simulation
from farhand.remote_site.interface.arm_driver import ArmDriver, ArmReading
from farhand.remote_site.interface.camera import Camera, CameraImage
from farhand.remote_site.robots.arm_plant import SimulatedJoints
from farhand.testing import check_arm, check_camera
from farhand.testing.__main__ import main
from tests.cells import JACO
from tests.remote_site.robots.own_drivers import put_drivers

ROBOT = JACO.robot
N = len(ROBOT.joints)


def at_once(_duration_s: float) -> None:
    """The pace of a simulation."""


def test_the_shipped_arm_is_sound():
    around = Surroundings.still(JACO)
    away = around.with_receptacle(around.receptacle + np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0]))
    arm = SimulatedJoints(Simulation(JACO), lambda _: away, np.array(ROBOT.home_rad))
    check_arm(arm, ROBOT, pace=at_once)


class Clock:
    """Time that passes only while the check waits."""

    def __init__(self) -> None:
        self.now_s = 0.0

    def __call__(self, duration_s: float) -> None:
        self.now_s += duration_s


class Sound:
    """Joints that go as they are told, each command for 0.1 s."""

    valid_s = 0.1

    def __init__(self, clock: Clock):
        self._clock, self._commanded_s, self._last_s = clock, -1.0, 0.0
        self.angles_rad, self.velocities = np.zeros(N), np.zeros(N)
        self.calls: list[str] = []

    def read(self) -> ArmReading:
        now_s = self._clock.now_s
        until_s = min(now_s, self._commanded_s + self.valid_s)
        self.angles_rad = self.angles_rad + self.velocities * max(until_s - self._last_s, 0.0)
        if now_s > self._commanded_s + self.valid_s:
            self.velocities = np.zeros(N)
        self._last_s = now_s
        return ArmReading(self.angles_rad, self.velocities.copy(), np.array([0.1 * now_s, 0, 0, 0, 0, 0]))

    def command(self, joint_velocities: np.ndarray, dt_s: float) -> None:
        self.read()
        self.velocities, self._commanded_s = joint_velocities.copy(), self._clock.now_s

    def start(self) -> None:
        self.calls.append("start")

    def halt(self) -> None:
        self.calls.append("halt")
        self.command(np.zeros(N), 0.0)

    def close(self) -> None:
        self.calls.append("close")


def checked(kind: Callable[[Clock], ArmDriver]) -> ArmDriver:
    clock = Clock()
    arm = kind(clock)
    check_arm(arm, ROBOT, pace=clock)
    return arm


def test_what_was_started_is_halted_and_closed():
    arm = checked(Sound)
    assert isinstance(arm, Sound) and arm.calls == ["start", "halt", "halt", "halt", "close"]


class Degrees(Sound):
    def read(self) -> ArmReading:
        reading = super().read()
        return replace(reading, joints_rad=np.degrees(reading.joints_rad))


class OtherOrder(Sound):
    def command(self, joint_velocities: np.ndarray, dt_s: float) -> None:
        super().command(joint_velocities[[1, 0, *range(2, N)]], dt_s)


class OneReversed(Sound):
    def command(self, joint_velocities: np.ndarray, dt_s: float) -> None:
        super().command(joint_velocities * np.where(np.arange(N) == 2, -1.0, 1.0), dt_s)


class NoVelocities(Sound):
    def read(self) -> ArmReading:
        return replace(super().read(), joint_velocities=np.zeros(N))


class GoesOn(Sound):
    valid_s = 10.0


class DeadSensor(Sound):
    def read(self) -> ArmReading:
        return replace(super().read(), wrench=np.zeros(6))


class NoWrench(Sound):
    def read(self) -> ArmReading:
        return replace(super().read(), wrench=None)  # pyright: ignore[reportArgumentType]


class Shared(Sound):
    def read(self) -> ArmReading:
        before = self.angles_rad
        reading = super().read()
        before[:] = reading.joints_rad
        self.angles_rad = before
        return replace(reading, joints_rad=before)


class Creeping(Sound):
    def command(self, joint_velocities: np.ndarray, dt_s: float) -> None:
        super().command(joint_velocities + 0.05, dt_s)


class Broken(Sound):
    def command(self, joint_velocities: np.ndarray, dt_s: float) -> None:
        raise TimeoutError("the controller does not answer")


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        (Degrees, " rad where 0.050 was asked for, forth"),
        (
            OtherOrder,
            f"{ROBOT.joints[1]} moved by 0.050 rad where {ROBOT.joints[0]} was to move: is the order",
        ),
        (OneReversed, f"{ROBOT.joints[2]} moved by -0.050 rad where 0.050 was asked for, forth"),
        (NoVelocities, f"joint_velocities: {ROBOT.joints[0]} at 0.000 rad/s while it moved with"),
        (GoesOn, "0.4 s after the last command: hold one for 0.1 s at most"),
        (DeadSensor, "wrench: [0.0, 0.0, 0.0, 0.0, 0.0, 0.0] all the time"),
        (NoWrench, "wrench: an array of shape (6,), got NoneType"),
        (Shared, "read: a reading changes when the arm moves on: return copies"),
        (Creeping, "told to stand, 0.050 rad/s at the beginning"),
        (Broken, "TimeoutError: the controller does not answer"),
        (lambda _: object(), "it has no read, command"),
    ],
)
def test_each_fault_of_an_arm_is_named(kind: Callable[[Clock], ArmDriver], words: str):
    with pytest.raises(AssertionError) as told:
        checked(kind)
    assert words in str(told.value)
    assert all(line.startswith("arm driver: ") for line in str(told.value).splitlines())


class Film:
    """A camera that takes other images each time."""

    def __init__(self, shape: tuple[int, ...] = (32, 48, 3)):
        self._pixels = np.zeros(shape, np.uint8)

    def capture(self) -> CameraImage | None:
        self._pixels = self._pixels + np.uint8(1)
        return CameraImage(self._pixels)


class OneBuffer(Film):
    def capture(self) -> CameraImage | None:
        self._pixels += np.uint8(1)
        return CameraImage(self._pixels)


class Dark(Film):
    def capture(self) -> CameraImage | None:
        return None


def test_a_camera_is_sound_or_its_fault_is_named():
    check_camera(Film(), pace=at_once)
    faults: dict[str, Camera] = {
        "uint8 of shape (height, width, 3), got uint8 of shape (32, 48)": Film((32, 48)),
        "an image changes when the next one is taken": OneBuffer(),
        "it took no image": Dark(),
    }
    for words, camera in faults.items():
        with pytest.raises(AssertionError) as told:
            check_camera(camera, pace=at_once)
        assert str(told.value).startswith("camera: ") and words in str(told.value)


def test_installed_drivers_are_checked_by_their_names(
    tmp_path_factory: pytest.TempPathFactory,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
):
    folder = tmp_path_factory.mktemp("installed")
    put_drivers(folder, "checked_here")
    monkeypatch.syspath_prepend(str(folder))

    def status(*words: str) -> int:
        monkeypatch.setattr(sys, "argv", ["farhand.testing", *words, "--at-once"])
        with pytest.raises(SystemExit) as ended:
            main()
        assert isinstance(ended.value.code, int)
        return ended.value.code

    assert status("--plant", "checked_here", "--perception", "checked_here") == 0
    told = capsys.readouterr().out
    assert "plant 'checked_here': nothing is wrong" in told and "perception 'checked_here': nothing" in told
    site = folder / "remote.toml"
    site.write_text('[plant]\nuse = "checked_here"\noptions = { fails = "nan" }\n')
    assert status("--config", str(site)) == 1
    assert "plant 'checked_here':\n  plant: " in capsys.readouterr().out
    assert status() == 2 and "a driver's name" in capsys.readouterr().err
    assert status("--plant", "nowhere") == 2 and "'nowhere'" in capsys.readouterr().err


def test_the_period_of_the_check_is_that_of_the_arm():
    assert TICK_S == 0.01
