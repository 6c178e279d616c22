"""An arm behind a driver of the user's own inserts its plug by the sight and the touch of that driver alone."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from farhand.common.arm.simulation.disturbances import Surroundings
from farhand.common.arm.simulation.simulation import Simulation
from farhand.common.clock import BootClock
from farhand.common.errors import DriverFailed
from farhand.common.mode_table import Action, ControlMode, Phase
from farhand.common.model.task_frame import TaskFrame
from farhand.local_site.script.scripted_result import succeeded
from farhand.remote_site.config import DriverChoice, RemoteConfig
from farhand.remote_site.interface.arm_driver import ArmReading
from farhand.remote_site.robots.driven_arm import DrivenArm
from farhand.remote_site.robots.embodiments import embodiment_of
from farhand.remote_site.robots.installed import Drivers, in_operation
from tests.cells import JACO
from tests.messages import said
from tests.remote_site.arm_bench import HOT_STAB, ArmBench, hot_stab_model
from tests.remote_site.bench import Bench


class Machine:
    """A machine in a workshop of its own: only its driver and its camera know the physics."""

    def __init__(self) -> None:
        self.physics = Simulation(JACO)
        self._around = Surroundings.still(JACO)
        self.physics.reset(np.array(JACO.robot.home_rad), self._around)
        self.parts: list[str] = []
        self.fails = ""

    @property
    def fault(self) -> str:
        return "emergency stop" if self.fails == "fault" else ""

    def start(self) -> None:
        self.parts.append("start")

    def close(self) -> None:
        self.parts.append("close")

    def halt(self) -> None:
        self.parts.append("halt")

    def read(self) -> ArmReading:
        if self.fails == "read":
            raise OSError("no joint state for 0.1 s")
        reading = ArmReading(self.physics.joints_rad, self.physics.joint_velocities, self.physics.wrench)
        if self.fails == "finite":
            return replace(reading, joints_rad=reading.joints_rad * np.nan)
        return replace(reading, wrench=np.zeros(3)) if self.fails == "shape" else reading

    def command(self, joint_velocities: np.ndarray, dt_s: float) -> None:
        if self.fails == "command":
            raise TimeoutError("the controller does not answer")
        self.physics.step(joint_velocities, self._around)

    # Its camera

    noise_std = (0.001, 0.005)

    def observe(self, now_s: float) -> list[TaskFrame]:
        return [TaskFrame.at(self.physics.mouth)]


class DrivenBench(ArmBench):
    """The supervisor of that machine, and an operator."""

    def __init__(self) -> None:
        self.machine, self.taught = Machine(), hot_stab_model()
        drivers = Drivers(arm=self.machine, perception=self.machine)
        robot = embodiment_of(HOT_STAB, RemoteConfig(), BootClock(), None, JACO, drivers)
        Bench.__init__(self, HOT_STAB, embodiment=robot)


def test_it_seats_its_plug_and_reports_what_it_felt_and_nothing_that_nobody_knows():
    bench = DrivenBench().executing()
    bench.run_until(Phase.SEATED)
    bench.run(11.0)
    assert bench.machine.physics.insertion.depth_m > 0.075
    report = bench.report
    assert report.succeeded is None and report.depth_m is None and succeeded(HOT_STAB, report) is None
    assert report.tracked_s == pytest.approx(10.0, abs=0.011)
    assert report.peak_force_n is not None and report.holding_force_n is not None
    assert 5.0 < report.holding_force_n < report.peak_force_n < HOT_STAB.limits.force_n


FAULTS = {
    "read": "OSError: no joint state for 0.1 s",
    "command": "TimeoutError: the controller does not answer",
    "finite": "arm driver: read: joints_rad: finite numbers only",
    "shape": "arm driver: read: wrench: an array of shape (6,), got shape (3,)",
    "fault": "the robot's machine reports a fault: emergency stop",
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_driver_that_fails_on_the_way_is_halted_and_told_and_works_again_once_it_is_mended(fault: str):
    bench = DrivenBench().executing()
    bench.run(0.5)
    bench.machine.parts.clear()
    bench.machine.fails = fault
    bench.run(0.1)
    assert bench.mode is ControlMode.STOPPED and bench.machine.parts.count("halt") >= 10
    (told,) = bench.events("stopped")
    assert FAULTS[fault] in said(told)
    bench.machine.fails = ""
    bench.run(0.5)
    assert bench.command(Action.RESET).accepted
    bench.run(0.2)
    assert bench.command(Action.ARM).accepted
    bench.execute()
    bench.run_until(Phase.SEATED)


MODULE = """
import numpy as np
from farhand import ArmReading

class Arm:
    def __init__(self, robot, options):
        self.n = len(robot.joints) + options.get("more", 0)

    def read(self):
        return ArmReading(np.zeros(self.n), np.zeros(self.n), np.zeros(6))

    def command(self, joint_velocities, dt_s):
        pass


class Sight:
    def __init__(self, task, options):
        self.n_frames = len(task.frame_names)

    def observe(self, now_s):
        return None
"""


def test_it_is_found_by_its_entry_point_and_made_for_the_robot_of_the_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.syspath_prepend(str(tmp_path))
    (tmp_path / "own_arm.py").write_text(MODULE)
    about = tmp_path / "own_arm-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: own_arm\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(
        "[farhand.arm_drivers]\nown-arm = own_arm:Arm\n[farhand.perceptions]\nown-sight = own_arm:Sight\n"
    )
    sight = DriverChoice("own-sight")
    config = RemoteConfig(arm_driver=DriverChoice("own-arm"), perception=sight)
    with in_operation(config, HOT_STAB, JACO, 0.0) as drivers:
        robot = embodiment_of(HOT_STAB, config, BootClock(), None, JACO, drivers)
    assert isinstance(robot.hardware, DrivenArm)
    wrong = RemoteConfig(arm_driver=DriverChoice("own-arm", {"more": 1}), perception=sight)
    with (
        pytest.raises(DriverFailed, match=r"arm_driver 'own-arm' \(own_arm:Arm\).*\(6,\), got shape \(7,\)"),
        in_operation(wrong, HOT_STAB, JACO, 0.0),
    ):
        pass
