from __future__ import annotations

import numpy as np
import pytest
from msgspec import UNSET, structs
from scipy.spatial.transform import Rotation

from farhand.common.arm.kinematics import Kinematics
from farhand.common.mode_table import Action, ControlMode, Phase
from farhand.common.model.task_frame import TaskFrame
from farhand.common.wire.codec import decode, encode
from farhand.common.wire.messages import FRAME_BYTES, MAX_TELEMETRY_BYTES, MOST_FRAMES, ArmState, Telemetry
from farhand.remote_site.telemetry import Reporter, numbers_of, rotation_of
from tests.remote_site.arm_bench import ArmBench
from tests.remote_site.bench import Bench, in_mode

BUDGET_B = 200


def reports(bench: Bench) -> Reporter:
    return Reporter(bench.robot, bench.clock)


@pytest.mark.parametrize("mode", ControlMode)
def test_a_report_says_the_mode_and_where_the_robot_is(mode: ControlMode):
    bench = in_mode(mode)
    report = reports(bench).report()
    assert report.mode is mode
    np.testing.assert_array_equal(report.position_m, bench.robot.sensing.effector.position_m)
    assert report.stamp.boot == bench.clock.boot and report.stamp.t_ns == bench.time.ns


def test_reports_are_numbered():
    reporter = reports(Bench())
    assert [reporter.report().seq for _ in range(3)] == [1, 2, 3]


def _recording(bench: Bench) -> None:
    bench.coupled()
    bench.command(Action.RECORD)
    bench.drive(1.0, 0.1)


@pytest.mark.parametrize("beginning", [_recording, Bench.executing])
def test_the_longest_report_fits_into_200_bytes(beginning):
    bench = Bench()
    bench.time.ns = 2**62  # no real clock is later
    bench.clock.boot = "12345678"
    bench.ask_lease(name="ü" * 30)
    bench.robot.contact.lease.holder = "ü" * 30
    beginning(bench)
    bench.robot.contact.stale_refused = bench.robot.contact.heartbeat_seq = 2**31
    bench.robot.machine.path_id, bench.robot.contact.heartbeat_received_ns = 2**16, 0
    reporter = reports(bench)
    reporter._seq = 2**31
    data = encode(reporter.report())
    assert len(data) <= BUDGET_B
    assert len(decode(data, Telemetry).holder.encode()) <= 16


def test_a_holders_name_is_cut_between_letters():
    bench = Bench()
    bench.ask_lease(name="a" + "ü" * 20)
    assert reports(bench).report().holder == "a" + "ü" * 7


def test_driving_is_reported_with_its_coupling_and_whether_the_robot_waits():
    bench = Bench().coupled()
    coupling = bench.robot.motion.coupling
    assert coupling is not None
    reporter = reports(bench)
    first = reporter.report()
    assert first.coupling_id == coupling.coupling_id and first.waiting
    bench.drive(0.1, 0.0)
    assert not reporter.report().waiting
    bench.run(0.6)
    assert reporter.report().waiting
    bench.command(Action.CLUTCH)
    last = reporter.report()
    assert last.coupling_id == 0 and not last.waiting


def test_an_execution_is_reported_until_it_ends():
    bench = Bench().executing()
    reporter = reports(bench)
    report = reporter.report()
    assert report.phase is Phase.APPROACHING
    execution = bench.robot.motion.execution
    assert execution is not None and (report.component >= 0 or execution.executor.way >= 0)
    assert report.elapsed_s == pytest.approx(0.5)
    bench.command(Action.ABORT)
    report = reporter.report()
    assert (report.phase, report.component, report.elapsed_s) == (Phase.NONE, -1, 0.0)


def test_the_newest_model_and_the_lease_are_named_by_their_first_digits():
    bench = Bench()
    reporter = reports(bench)
    assert (reporter.report().model, reporter.report().lease) == ("", "")
    bench.ask_lease()
    sha256 = bench.send_model().sha256
    report = reporter.report()
    assert report.model == sha256[:8] and report.lease == bench.lease_id[:4]


def test_a_heartbeat_comes_back_with_the_time_that_the_robot_had_it():
    bench = Bench().armed()
    bench.run(1.0)
    contact, reporter = bench.robot.contact, reports(bench)
    bench.time.advance(0.25)
    report = reporter.report()
    assert report.heartbeat_echo == contact.heartbeat_seq > 0
    assert report.heartbeat_held_ms == pytest.approx((bench.time.ns - contact.heartbeat_received_ns) * 1e-6)


def test_a_frame_is_reported_by_its_rotation():
    angle = 0.3
    plane = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    assert rotation_of(TaskFrame(np.eye(2), np.ones(2))) == ()
    assert rotation_of(TaskFrame(plane, np.ones(2))) == (pytest.approx(angle),)
    space = Rotation.from_rotvec([0.1, -0.4, 0.2])
    assert rotation_of(TaskFrame(space.as_matrix(), np.ones(3))) == pytest.approx((0.1, -0.4, 0.2))


def test_further_frames_are_reported_within_their_bytes():
    angle = 0.3
    plane = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    assert numbers_of([]) is UNSET
    assert numbers_of([TaskFrame(plane, np.ones(2)), TaskFrame.identity(2)]) == pytest.approx(
        (1.0, 1.0, angle, 0.0, 0.0, 0.0)
    )
    bench = ArmBench()
    alone = reports(bench).report()
    turned = Rotation.from_rotvec([0.1, -0.4, 0.2]).as_matrix()
    for n in range(1, MOST_FRAMES):
        more = structs.replace(alone, other_frames=numbers_of([TaskFrame(turned, np.ones(3))] * n))
        assert decode(encode(more), Telemetry).other_frames == pytest.approx(more.other_frames)
        assert len(encode(more)) <= len(encode(alone)) + n * FRAME_BYTES


def test_an_arm_reports_its_tool_its_joints_and_its_force_within_264_bytes():
    bench = ArmBench().executing()
    bench.run(2.0)
    bench.time.ns, bench.clock.boot = 2**62, "12345678"
    bench.robot.contact.stale_refused = bench.robot.contact.heartbeat_seq = 2**31
    bench.robot.machine.path_id, bench.robot.contact.heartbeat_received_ns = 2**16, 0
    bench.robot.contact.lease.holder = "ü" * 30
    reporter = reports(bench)
    reporter._seq = 2**31
    data = encode(reporter.report(overruns=2**31))
    assert len(data) <= MAX_TELEMETRY_BYTES
    report = decode(data, Telemetry)
    arm = report.arm
    assert isinstance(arm, ArmState) and arm.overruns == 2**31
    tip = bench.robot.sensing.effector.point
    turn = Rotation.from_rotvec(arm.rotation_rad).as_matrix()
    np.testing.assert_allclose(turn, TaskFrame.at(tip).A, atol=1e-5)
    kinematics = Kinematics(bench.simulation.cell)
    kinematics.update(np.array(arm.joints_rad))
    np.testing.assert_allclose(kinematics.tip[:3], tip[:3], atol=1e-5)
    np.testing.assert_allclose(report.position_m, tip[:3], atol=1e-5)
