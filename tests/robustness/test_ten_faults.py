"""Ten faults of good systems, each as a test that the code here does not have it."""

from __future__ import annotations

import ast
import json
import pickle
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from msgspec import structs

from farhand.common.json_lines import JsonLinesFile
from farhand.common.mode_table import Action, ControlMode, Phase
from farhand.common.model.manifold import Manifold
from farhand.common.wire import keys
from farhand.common.wire.codec import decode
from farhand.common.wire.messages import StopAck, Telemetry
from farhand.local_site.console import intents
from farhand.local_site.exchange.report_age import LinkHealth
from farhand.local_site.teaching.recording import RawRecording
from tests.meeting import Meeting, Site
from tests.messages import said
from tests.remote_site.bench import DT_S, Bench
from tests.remote_site.planar import TASK

ROOT = Path(__file__).parents[2]
HOUR_S = 3600.0
BRAKING_S = TASK.limits.speed_m_s / TASK.limits.acceleration_m_s2


def driving(meeting: Meeting, folder: Path) -> Site:
    """Ann, in the middle of a fast motion of her hand."""
    ann = meeting.join("ann", folder)
    ann.ask(Action.ARM, Action.COUPLE)
    ann.drive(1.5, 0.2, 0.5)
    ann.drive(0.6, 0.9, 0.5)
    assert meeting.mode is ControlMode.DIRECT and meeting.speed_m_s > 0.3
    return ann


# 1. MoveIt Servo: age = now - header.stamp, so a stamp of the future never grows old (moveit2#772, "joint
# continues moving for ever").
@pytest.mark.parametrize("ahead_s", [-HOUR_S, 0.0, HOUR_S])
def test_a_watchdog_needs_no_clock_but_the_robots_own(ahead_s: float, tmp_path: Path):
    meeting = Meeting(sites_ahead_s=2 * HOUR_S + ahead_s, sites_drift=0.01)
    ann = driving(meeting, tmp_path)
    ann.link.cut()
    meeting.run(0.5 + BRAKING_S + 0.2)  # the last thing heard was up to two periods of a console old
    assert meeting.mode is ControlMode.HOLD and meeting.speed_m_s < 1e-6


# 2. stretch_web_teleop#3: after a reconnect the robot runs every click that was queued. Also
# GR00T-WholeBodyControl#265: the delay grows to six seconds over a session.
def test_nothing_that_waited_out_an_outage_moves_the_robot(tmp_path: Path):
    meeting = Meeting()
    ann = driving(meeting, tmp_path)
    ann.ask(intents.LoadSamples(), intents.SendModel())
    ann.link.stalled = True
    for k in range(100):  # the operator does not see it at first and goes on
        ann.drive(0.05, 0.2 + 0.005 * k, 0.9)
    ann.console.submit(intents.CommandRobot(Action.EXECUTE))
    meeting.run(0.1)
    meeting.run(5.0)
    assert meeting.mode is ControlMode.HOLD
    stands, refused = meeting.position_m, meeting.robot.supervisor.contact.stale_refused
    ann.link.mend()
    meeting.run(5.0)
    assert meeting.mode is ControlMode.HOLD
    np.testing.assert_array_equal(meeting.position_m, stands)
    assert meeting.robot.supervisor.contact.stale_refused > refused
    assert ann.picture.robot is not None
    newest = [
        decode(data, Telemetry) for channel, data in meeting.robots_end.sent if channel is keys.TELEMETRY
    ][-1]
    assert ann.picture.robot.stamp == newest.stamp  # shown is the newest, no queue


# 3. Cockpit#215, PR#713: the ground station went on sending after the joystick had died, so that the
# autopilot's own failsafe could never act.
def test_a_keep_alive_without_a_hand_keeps_nothing_moving():
    bench = Bench().coupled()
    bench.drive(1.5, 0.0)
    bench.drive(0.5, 0.8)
    assert bench.speed_m_s > 0.1
    bench.run(0.5 + BRAKING_S + 2 * DT_S)  # heartbeats and renewals go on all the time
    assert bench.mode is ControlMode.DIRECT and bench.speed_m_s < 1e-6
    bench.run(10.0)
    assert bench.mode is ControlMode.HOLD
    assert "no input for 10 s" in said(bench.events("decoupled")[0])


# 4. videosdk-teleop and MoveIt Servo: 100 ms whatever the link, so that over a satellite every command is
# dropped or the limit is switched off.
@pytest.mark.parametrize("round_trip_s", [0.02, 0.6, 2.0, 6.0, 10.0])
def test_the_limit_of_age_follows_the_link(round_trip_s: float):
    bench = Bench(delay_s=round_trip_s).coupled()
    bench.run(1.0)
    bench.drive(0.2, 0.0)
    bench.drive(20.0, 0.3)
    assert bench.mode is ControlMode.DIRECT and bench.robot.contact.stale_refused == 0
    np.testing.assert_allclose(bench.position_m, np.add(TASK.start_m, (0.3, 0.0)), atol=1e-3)
    held_up = bench.echo()
    bench.run(1.1)
    assert not bench.command(Action.CLUTCH, echo=held_up).accepted


# 5. LeKiwi: the watchdog stops the base alone; the arm keeps its last goal.
@pytest.mark.parametrize("beginning", [Bench.coupled, Bench.executing])
def test_a_watchdog_stops_every_axis(beginning):
    bench = beginning(Bench(structs.replace(TASK, lost_link="hold")))
    if bench.mode is ControlMode.DIRECT:
        bench.drive(1.2, 0.0)
        bench.drive(0.6, 0.5, -0.5)
    moving = bench.plant.read().velocity_m_s
    assert (np.abs(moving) > 0.005).all()
    bench.run(5.0, present=False)
    stands = bench.position_m
    np.testing.assert_array_equal(bench.plant.read().velocity_m_s, np.zeros(2))
    bench.run(5.0, present=False)
    np.testing.assert_array_equal(bench.position_m, stands)


# 6. LeRobot, robot_client.py: a latency from the unsynchronised clocks of two machines.
@pytest.mark.parametrize("ahead_s", [-HOUR_S, HOUR_S])
def test_a_round_trip_is_measured_on_one_clock(ahead_s: float, tmp_path: Path):
    meeting = Meeting(sites_ahead_s=2 * HOUR_S + ahead_s, sites_drift=0.05)
    ann = meeting.join("ann", tmp_path)
    meeting.run(3.0)
    round_trip_s, age_s = ann.picture.link.round_trip_s, ann.picture.link.age_s
    assert round_trip_s is not None and 0.0 <= round_trip_s <= 0.1
    assert age_s is not None and 0.0 <= age_s <= 0.1


class _Harm:
    """Writes a file when it is unpickled."""

    def __init__(self, file: Path):
        self._file = file

    def __reduce__(self):
        return Path.touch, (self._file,)


# 7. LeRobot: pickle.loads of what came over an open port (policy_server.py, robot_client.py).
def test_nothing_is_ever_unpickled(tmp_path: Path):
    meeting = Meeting()
    ann = meeting.join("ann", tmp_path / "ann")
    harm = tmp_path / "harm"
    data = pickle.dumps(_Harm(harm))
    for deliveries in meeting.robots_end.subscribers.values():
        for deliver in deliveries:
            deliver(data)
    for channel in meeting.robots_end.servers:
        answers: list[bytes | None] = []
        ann.link.ask(channel, data, 1.0, answers.append)
        assert not answers  # not understood, not answered
    for channel in list(ann.link.subscribers):
        ann.link.hear(channel, data)
    meeting.run(1.0)
    assert not harm.exists() and ann.picture.in_control
    pickle.loads(data)
    assert harm.exists()  # it would have been harmful


def test_no_shipped_module_imports_what_unpickles():
    forbidden = {"pickle", "shelve", "marshal", "dill", "cloudpickle", "joblib"}
    for package in ("common", "local_site", "remote_site", "deploy", "evaluation"):
        for file in (ROOT / package).rglob("*.py"):
            for node in ast.walk(ast.parse(file.read_text())):
                names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
                names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
                assert not {name.partition(".")[0] for name in names} & forbidden, file
                if isinstance(node, ast.keyword) and node.arg == "allow_pickle":
                    assert isinstance(node.value, ast.Constant) and node.value.value is False, file


_WRITER = """
import sys, numpy as np
from pathlib import Path
from farhand.common.json_lines import JsonLinesFile
from farhand.common.model.manifold import Manifold
from farhand.common.model.task_frame import TaskFrame
from farhand.local_site.teaching.recording import RawRecording
folder = Path(sys.argv[1])
log, raw = JsonLinesFile(folder / "events.jsonl"), RawRecording(folder / "raw.jsonl", Manifold(2), ("goal",))
raw.begin([TaskFrame.identity(2)])
points, times = [], []
for n in range(10**9):
    log.append(n=n, text="x" * 200)
    points.append(np.array([0.001 * n, 0.5])); times.append(0.1 * n)
    raw.follow(points, times)
    if n % 100 == 0:
        print(n, flush=True)
"""


# 8. lerobot#2495, #3522, almond-bot/axol#154, #158, #193: a crash took the whole session (40 episodes).
def test_a_killed_process_leaves_all_but_its_last_moment(tmp_path: Path):
    words = [sys.executable, "-c", _WRITER, str(tmp_path)]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as writer:
        assert writer.stdout is not None
        log_file, n_printed = tmp_path / "events.jsonl", 0
        while n_printed < 12 or not log_file.exists() or log_file.read_bytes().count(b"\n") < 200:
            assert writer.stdout.readline()
            n_printed += 1
        writer.send_signal(signal.SIGKILL)
    log = JsonLinesFile(tmp_path / "events.jsonl")
    log.append(n=-1)
    log.close()
    lines = log.path.read_bytes().splitlines()
    whole = [json.loads(line)["n"] for line in lines[:-2]]
    assert whole == list(range(len(whole))) and len(whole) > 100
    assert json.loads(lines[-1])["n"] == -1  # what comes later is not spoilt by what was cut short
    left_over = RawRecording(tmp_path / "raw.jsonl", Manifold(2), ("goal",)).left_over()
    assert left_over is not None and len(left_over.time_s) > 500


# 9. ros2_controllers#1683: a time-out that never recovers. ros_controllers#363 (2018), ros2_controllers#95
# (2020): no time-out at all.
def test_every_time_out_ends_and_recovers(tmp_path: Path):
    meeting = Meeting()
    ann = meeting.join("ann", tmp_path)
    ann.ask(Action.ARM)
    for _ in range(3):
        ann.ask(Action.COUPLE)
        ann.drive(1.5, 0.2, 0.5)
        assert meeting.mode is ControlMode.DIRECT
        ann.link.stalled = True
        ann.console.submit(intents.CommandRobot(Action.CLUTCH))
        meeting.run(20.0)
        assert meeting.mode is ControlMode.HOLD and ann.picture.link.health is LinkHealth.LOST
        assert not ann.picture.pending  # the clutch was given up, and its operator told
        assert ann.told("clutch: NOT DELIVERED")
        ann.link.mend()
        meeting.run(3.0)
        assert ann.picture.in_control
    ann.ask(Action.COUPLE)
    before = meeting.position_m
    ann.drive(1.5, 0.5, 0.5)
    ann.drive(2.0, 0.6, 0.5)
    np.testing.assert_allclose(meeting.position_m - before, [0.1, 0.0], atol=2e-3)


# 10. stretch_web_teleop#38, #109, dimos PR#3173: an emergency stop that is acknowledged before it holds, and
# one that ends by itself.
def test_a_stop_says_that_it_stands_when_it_does_and_ends_by_reset_alone():
    bench = Bench().executing()
    bench.run(0.5)
    assert bench.speed_m_s > 0.05
    bench.stop()
    assert [ack.standing for ack in bench.heard(StopAck)] == [False]
    while not any(ack.standing for ack in bench.heard(StopAck)):
        bench.run(DT_S)
    assert bench.speed_m_s <= 2e-3
    stands = bench.position_m
    bench.run(5.0, present=False)  # the lease ends, the operator comes back, and tries everything
    bench.ask_lease()
    sha256 = bench.send_model().sha256
    for action in set(Action) - {Action.RESET, Action.SET_PACE}:
        assert not bench.command(action, model_sha256=sha256).accepted
    bench.stop()
    bench.drive(60.0, 0.9)
    assert bench.mode is ControlMode.STOPPED
    np.testing.assert_allclose(bench.position_m, stands, atol=1e-4)
    assert bench.command(Action.RESET).accepted
    bench.run(5.0)
    assert bench.mode is ControlMode.DISARMED and bench.robot.phase is Phase.NONE
    np.testing.assert_allclose(bench.position_m, stands, atol=1e-4)
