from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from msgspec import structs
from scipy.spatial.transform import Rotation

from farhand.common.arm.cell import Cell, Receptacle
from farhand.common.arm.kinematics import compose, difference, inverse
from farhand.common.arm.simulation.starts_and_goals import Box
from farhand.common.errors import InvalidConfiguration
from farhand.common.mode_table import Action, ControlMode, Phase
from farhand.common.model.task_frame import TaskFrame
from farhand.common.wire.messages import StopAck
from farhand.deploy.places import find_robot
from farhand.remote_site.config import RemoteConfig
from farhand.remote_site.robots.plant_memory import PlantMemory
from farhand.remote_site.robots.simulated_arm import SimulatedArm
from farhand.remote_site.robots.simulated_environment import SLIDE_M_S
from tests.cells import JACO
from tests.messages import said
from tests.remote_site.arm_bench import HOT_STAB, ArmBench, hot_stab_model, seated

MM = 1e-3


def in_bore(**changes) -> ArmBench:
    """A robot that finds its plug in the bore, armed."""
    bench = ArmBench(remembered=seated(), **changes)
    bench.run(1.0)
    bench.armed()
    return bench


def local_tip(bench: ArmBench) -> np.ndarray:
    """The plug's pose in the true frame of the receptacle."""
    return compose(inverse(bench.simulation.mouth), bench.tip)


def test_a_hot_stab_by_commands_ends_seated_and_is_reported():
    bench = ArmBench(seed=1).executing()
    bench.run_until(Phase.SEATED)
    bench.run(2.0)
    assert bench.mode is ControlMode.AUTONOMOUS and bench.robot.phase is Phase.SEATED
    report = bench.report
    assert report.succeeded and report.arrived_after_s is not None
    assert report.depth_m == pytest.approx(0.085, abs=MM)
    assert report.lateral_m is not None and report.lateral_m < 4.0 * MM
    assert report.peak_force_n is not None and report.peak_force_n < 150.0
    assert report.holding_force_n == pytest.approx(20.0, abs=6.0)
    (completed,) = [event for event in bench.events("completed") if event.action == Action.EXECUTE]
    assert said(completed).startswith("seated after")


def test_the_plug_is_taken_out_again_by_a_robot_that_extracts():
    bench = ArmBench(seed=3, skill="extract")
    bench.taught = hot_stab_model("hot-stab-removal")
    assert bench.depth_m > 0.08
    bench.executing()
    bench.run_until(Phase.ARRIVED)
    bench.run(3.0)
    report = bench.report
    assert report.succeeded and report.depth_m == pytest.approx(-0.12, abs=15.0 * MM)
    assert report.peak_force_n is not None and report.peak_force_n < 60.0


@pytest.mark.parametrize("name", ["jaco", "panda", "baxter-right"])
def test_a_restarted_robot_finds_its_plug_in_the_bore_and_holds_it_disarmed(name: str, tmp_path: Path):
    cell = Cell(robot=find_robot(name))
    memory = PlantMemory(tmp_path / "state.json")
    memory.remember(seated(cell))
    memory.close()
    state = PlantMemory(tmp_path / "state.json").load(3)
    assert state is not None and state.arm is not None
    assert len(state.arm.joints_rad) == len(cell.robot.joints)
    bench = ArmBench(cell=cell, remembered=state)
    assert bench.mode is ControlMode.DISARMED
    np.testing.assert_allclose(bench.simulation.joints_rad, state.arm.joints_rad, atol=1e-12)
    deep_m, forces_n = bench.depth_m, []
    for _ in range(200):
        bench.run(bench.dt_s)
        forces_n.append(bench.force_n)
    assert bench.depth_m == pytest.approx(deep_m, abs=MM) and deep_m > 0.08
    assert max(forces_n) < 60.0
    assert bench.armed().command(Action.RETRACT).accepted  # and goes on from there
    bench.run_until(Phase.NONE)
    assert bench.depth_m < -0.03


def test_a_robot_at_rest_is_not_remembered_anew():
    bench = ArmBench()
    bench.run(2.0)
    before = bench.remembered
    bench.run(0.1)
    assert bench.remembered.is_like(before)
    assert bench.armed().command(Action.GO_TO_READY).accepted
    bench.run(0.2)
    assert not bench.remembered.is_like(before)


def test_a_robot_that_cannot_be_where_it_was_starts_anew():
    state = seated()
    assert state.arm is not None
    twisted = structs.replace(state, arm=structs.replace(state.arm, joints_rad=(0.0,) * 6))
    fresh = ArmBench()
    np.testing.assert_array_equal(ArmBench(remembered=twisted).tip, fresh.tip)


def test_stop_in_the_bore_of_a_swaying_receptacle_holds_gently_in_its_frame():
    bench = in_bore(disturbances="typical")
    bench.execute()
    bench.run_until(Phase.SEATED)
    bench.stop()
    forces_n, depths_m = [], []
    for _ in range(1000):
        bench.run(bench.dt_s)
        forces_n.append(bench.force_n)
        depths_m.append(bench.depth_m)
    assert bench.mode is ControlMode.STOPPED and bench.heard(StopAck)[-1].standing
    assert np.quantile(forces_n, 0.95) <= 60.0
    assert min(depths_m) > 0.06  # it went with the receptacle, which moved by up to 40 mm


def test_coupling_and_clutching_at_rest_move_nothing():
    bench = ArmBench()
    bench.run(1.0)
    start = bench.tip
    bench.armed()
    for action in (Action.COUPLE, Action.CLUTCH, Action.COUPLE, Action.CLUTCH, Action.DISARM):
        assert bench.command(action).accepted
        for _ in range(50):
            if bench.mode is ControlMode.DIRECT:
                bench.hand(0.1, 0.2, 0.3)
            bench.run(bench.dt_s)
            assert np.linalg.norm((bench.tip - start)[:3]) <= 1.0 * MM


def test_the_arm_follows_the_differences_of_the_hands_position_and_orientation():
    bench = ArmBench().coupled()
    hand = Rotation.from_euler("xyz", (0.4, -0.3, 1.0))
    turn = Rotation.from_rotvec((0.0, 0.0, 0.3))  # about the axes of the world
    start = bench.robot.sensing.effector.controlled[0]
    bench.drive(0.3, 5.0, 5.0, 5.0, rotation_rad=tuple(hand.as_rotvec()))
    np.testing.assert_allclose(bench.tip[:3], start[:3], atol=MM)
    speeds = []
    for _ in range(65):
        bench.drive(bench.dt_s, 4.9, 5.05, 5.02, rotation_rad=tuple((turn * hand).as_rotvec()))
        speeds.append(np.linalg.norm(bench.arm.plant.servo.setpoint.velocity[:3]))
    assert max(speeds) <= 0.2 * bench.arm.max_speed_m_s + 1e-9  # in the first second of driving
    bench.drive(3.0, 4.9, 5.05, 5.02, rotation_rad=tuple((turn * hand).as_rotvec()))
    np.testing.assert_allclose(bench.tip[:3] - start[:3], (-0.1, 0.05, 0.02), atol=2.0 * MM)
    np.testing.assert_allclose(TaskFrame.at(bench.tip).A, turn.as_matrix() @ TaskFrame.at(start).A, atol=0.02)


def test_in_the_bore_the_hand_leads_along_its_axis_alone_until_the_tip_has_left_the_mouth():
    bench = in_bore()
    before = local_tip(bench)
    assert bench.command(Action.COUPLE).accepted
    bench.drive(1.2, 0.0, 0.0, 0.0)
    assert np.linalg.norm((local_tip(bench) - before)[:3]) <= 1.0 * MM
    axis = TaskFrame.at(bench.simulation.mouth).A[:, 2]
    aside = 0.2 * np.cross(axis, (0.0, 0.0, 1.0))
    forces_n = []
    for k in range(100):
        bench.drive(bench.dt_s, *(k / 100.0 * aside))
        forces_n.append(bench.force_n)
    assert local_tip(bench)[2] > 0.08 and max(forces_n) < 60.0
    for k in range(500):
        bench.drive(bench.dt_s, *(aside - min(k / 250.0, 1.0) * 0.15 * axis))
        forces_n.append(bench.force_n)
    out = local_tip(bench)
    assert out[2] < -0.03 and np.hypot(*out[:2]) < 0.02 and max(forces_n) < 60.0


def test_retract_goes_back_along_the_axis_slowly_in_the_bore_and_keeps_the_orientation():
    bench = in_bore()
    before, speeds = local_tip(bench), []
    assert bench.command(Action.RETRACT).accepted
    while bench.robot.phase is Phase.RETRACTING:
        depth_m = bench.depth_m
        bench.run(bench.dt_s)
        if bench.depth_m > 0.0:
            speeds.append((depth_m - bench.depth_m) / bench.dt_s)
    after = local_tip(bench)
    np.testing.assert_allclose(after[:3], before[:3] - (0.0, 0.0, 0.15), atol=8.0 * MM)
    assert np.linalg.norm(difference(before, after)[3:]) < 0.05
    assert max(speeds) < 0.045 and bench.mode is ControlMode.HOLD
    assert bench.events("completed")[-1].action == Action.RETRACT


def test_ready_is_home_and_out_of_the_bore_only():
    bench = in_bore()
    reply = bench.command(Action.GO_TO_READY)
    assert not reply.accepted and "retract" in said(reply)
    bench = ArmBench(seed=2).armed()
    assert bench.command(Action.GO_TO_READY).accepted
    bench.run_until(Phase.NONE)
    home = bench.arm.plant.servo.kinematics
    home.update(np.array(bench.simulation.cell.robot.home_rad))
    np.testing.assert_allclose(bench.tip, home.tip, atol=5.0 * MM)


def test_an_insertion_that_is_out_of_reach_is_refused_at_its_preview():
    state = seated()
    assert state.arm is not None
    far = structs.replace(state.arm, receptacle=(1.15, 0.3, 0.5, *state.arm.receptacle[3:]))
    bench = ArmBench(remembered=structs.replace(state, arm=far)).armed()
    bench.run(1.0)
    bench.preview(bench.send_model().sha256)
    (failed,) = bench.events("failed")
    assert failed.action == Action.PREVIEW and "out of the arm's reach" in said(failed)


def test_a_preview_warns_where_the_tool_may_turn_either_way_round():
    state = ArmBench().remembered
    assert state.arm is not None
    *others, wrist = state.arm.joints_rad
    turned = structs.replace(state.arm, joints_rad=(*others, wrist + np.radians(172.0)))
    bench = ArmBench(remembered=structs.replace(state, arm=turned)).armed()
    bench.run(1.0)
    bench.preview(bench.send_model().sha256)
    (done,) = bench.events("completed")[-1:]
    assert done.action == Action.PREVIEW and "either way round" in said(done)


def test_a_plug_that_jams_again_and_again_gives_up_and_holds():
    blocked = Cell(robot=JACO.robot, receptacle=Receptacle(depth_m=0.030))  # where the robot expects 85 mm
    bench = ArmBench(seed=1, cell=blocked, attempts=1, tracker="clean").executing()
    bench.run_until(Phase.RECOVERING)
    for _ in range(60):
        bench.run(0.5)
        if bench.mode is not ControlMode.AUTONOMOUS:
            break
    assert bench.mode is ControlMode.HOLD
    assert said(bench.events("gave up")[0]) == "jammed too often"
    assert bench.events("failed")[-1].action == Action.EXECUTE and not bench.report.succeeded
    bench.run(2.0)
    assert bench.force_n < 60.0


def test_a_moved_receptacle_slides_to_its_place_and_stays_in_its_box():
    bench = ArmBench()
    bench.run(0.1)
    before = bench.simulation.mouth[:3]
    bench.arm.move_target(np.array([0.9, 0.0, 0.4]))
    bench.run(1.0)
    assert np.linalg.norm(bench.simulation.mouth[:3] - before) <= SLIDE_M_S * 1.05
    bench.run(10.0)
    np.testing.assert_allclose(bench.simulation.mouth[:3], (Box.of(JACO.robot).high_m[0], 0.0, 0.4), atol=MM)


def test_an_arm_runs_at_its_own_rate_and_no_other():
    with pytest.raises(InvalidConfiguration, match="control_hz"):
        SimulatedArm(HOT_STAB, RemoteConfig(control_hz=50.0), JACO)
    assert SimulatedArm(HOT_STAB, RemoteConfig(control_hz=100.0), JACO).control_hz == 100.0
