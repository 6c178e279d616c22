"""Farhand drives a robot behind real ROS 2 topics: a process of its own plays it, and alone knows where the plug is."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from farhand.common.address import free_port
from farhand.common.mode_table import ControlMode
from farhand.common.wire import keys
from farhand.common.wire.messages import EventsReply, EventsRequest
from farhand.evaluation.harness.farhand_process import HeardProcess
from tests.examples.ros2_bench import (
    FARHAND,
    PATIENCE_S,
    ROS_PYTHON,
    TASK,
    Operator,
    Robot,
    free_domain,
    moves,
    stands,
)
from tests.farhand_process import running
from tests.messages import said

pytestmark = pytest.mark.ros2

HALTS_WITHIN_S = 0.2


@pytest.fixture(scope="module")
def environment(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    if not ROS_PYTHON.exists():
        pytest.skip("no ROS 2 beside Farhand: make ros")
    return {
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "ROS_DOMAIN_ID": str(free_domain()),
        "ROS_LOG_DIR": str(tmp_path_factory.mktemp("ros")),
    }


@pytest.fixture(scope="module")
def robot(environment: dict[str, str]) -> Iterator[Robot]:
    """One robot for all tests: the second finds it where the first left it."""
    robot = Robot(environment)
    try:
        yield robot
        assert robot.end() == 0
    finally:
        robot.kill()


@pytest.fixture(scope="module")
def gate(environment: dict[str, str]) -> Iterator[str]:
    """The topic that Farhand sends commands to: a gate on the robot's machine passes them on."""
    with subprocess.Popen(
        [str(ROS_PYTHON), "-P", "-m", "farhand_ros2.command_gate"], env={**os.environ, **environment}
    ) as process:
        try:
            yield "/farhand/commands"
            process.terminate()
            assert process.wait(PATIENCE_S) == 0
        finally:
            process.kill()


@pytest.fixture(scope="module")
def site(
    environment: dict[str, str], robot: Robot, gate: str, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[tuple[HeardProcess, Operator]]:
    """The robot's site, and an operator who holds its lease."""
    file, endpoint = tmp_path_factory.mktemp("site") / "remote.toml", f"tcp/127.0.0.1:{free_port()}"
    file.write_text(f"""
        task = "{TASK}"
        lease_s = 600.0
        max_age_s = 600.0
        arm_driver = {{ use = "ros2", options = {{ commands = "{gate}" }} }}
        perception.use = "ros2"
    """)
    words = ("remote", f"--config={file}", f"--listen={endpoint}")
    with running(*words, environment=environment, command=FARHAND) as process:
        process.until("the robot is ready")
        operator = Operator(endpoint)
        try:
            yield process, operator
        finally:
            operator.close()


CHECK = """
from farhand.deploy.places import find_robot
from farhand.testing import check_arm
from farhand_ros2.arm import RosArm

check_arm(RosArm(find_robot("jaco"), {"silent_s": 0.5}), find_robot("jaco"))
"""


@pytest.mark.soak
def test_the_arm_s_driver_is_sound_joint_by_joint(environment: dict[str, str], robot: Robot):
    """First of all, while the plug is in the open."""
    done = subprocess.run(
        [str(ROS_PYTHON), "-P", "-c", CHECK],
        check=False,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr


def test_it_does_the_job_and_the_simulation_knows_that_the_plug_is_seated(
    robot: Robot, site: tuple[HeardProcess, Operator]
):
    process, operator = site
    assert robot.ask("truth")["depth_m"] < 0.0
    operator.insert(operator.send_model())
    truth = robot.until(lambda truth: truth["seated"])
    assert not truth["complaint"] and "Traceback" not in process.words


def test_it_halts_within_0_2_s_of_the_last_message_goes_on_once_reset_and_stands_when_farhand_is_killed(
    robot: Robot, site: tuple[HeardProcess, Operator]
):
    process, operator = site
    operator.retract(robot)
    assert moves(robot.ask("silence"))
    operator.report(lambda told: told.mode is ControlMode.STOPPED)
    halted = robot.until(stands)
    assert halted["moved_for_s"] <= HALTS_WITHIN_S
    answer = operator.ask(keys.EVENTS, EventsRequest(), EventsReply)
    assert "/joint_states: silent for 0.1 s" in " ".join(said(event) for event in answer.events)
    robot.ask("speak")
    operator.retract(robot)
    assert "Traceback" not in process.words
    process.kill()  # nobody of Farhand's is left to send zeros
    robot.until(lambda truth: truth["commanded_rad_s"] == 0.0)


SILENT = """
import sys, numpy as np
from types import SimpleNamespace as Of
from farhand.deploy.places import find_robot, find_task
from farhand.testing import check_perception
from farhand_ros2.arm import RosArm
from farhand_ros2.tracker import RosTracker

for duration_s in (2.0, 5.0, 15.0, 45.0):  # a busy machine takes long to find who publishes
    try:
        check_perception(RosTracker(find_task("hot-stab"), {}), n_dims=3, duration_s=duration_s)
        break
    except AssertionError as findings:
        if "it saw nothing" not in str(findings) or duration_s == 45.0:
            raise
by_tf = RosTracker(find_task("hot-stab"), {"tf_frames": ["receptacle"], "frame_id": "base_link"})
assert by_tf.observe(0.0) is None
still = {"translation": Of(x=0.0, y=0.0, z=0.5), "rotation": Of(w=1.0, x=0.0, y=0.0, z=0.0)}
message = Of(transforms=[Of(header=Of(frame_id="base_link"), child_frame_id="receptacle", transform=Of(**still))])
by_tf.take_tf(message)
first = by_tf.observe(0.1)
assert first[0].b[2] == 0.5 and by_tf.observe(0.2) is first  # measured once
by_tf.take_tf(message)
assert by_tf.observe(0.3) is not first
arm = RosArm(find_robot("jaco"), {})
arm.start()
arm.command(np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.1]), 0.01)
print("commanded", flush=True)
sys.stdin.read()
arm.close()
"""


def test_the_tracker_is_sound_and_the_arm_is_sent_zeros_when_farhand_falls_silent(
    environment: dict[str, str], robot: Robot
):
    before = robot.ask("truth")["commands_to_move"]
    with subprocess.Popen(
        [str(ROS_PYTHON), "-P", "-c", SILENT], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        env={**os.environ, **environment},
    ) as silent:  # fmt: skip
        assert silent.stdout is not None and silent.stdout.readline() == "commanded\n"
        robot.until(lambda truth: truth["commands_to_move"] == before + 1)
        robot.until(lambda truth: truth["commanded_rad_s"] == 0.0)
        silent.communicate("")
        assert silent.returncode == 0


@pytest.mark.soak
def test_a_demo_does_the_whole_job_and_says_that_nobody_can_judge(
    environment: dict[str, str], robot: Robot, tmp_path: Path
):
    config, result = tmp_path / "remote.toml", tmp_path / "result.json"
    config.write_text("arm_driver.options.silent_s = 0.5\n")  # it must not end because this machine is busy
    words = ("demo", f"--task={TASK}", "--link=lan", "--arm-driver=ros2", "--perception=ros2")
    more = ("--remote-config", config, "--json", result)
    with running(*words, *more, environment=environment, command=FARHAND) as demo:
        assert demo.wait() == 0, demo.words
        assert f"task {TASK}: DONE, NOT JUDGED" in demo.words and "Traceback" not in demo.words
    told = json.loads(result.read_text(encoding="utf-8"))
    assert told["success"] is None and 0.0 < told["execution"]["peak_force_n"] < 250.0
    truth = robot.ask("truth")
    assert truth["seated"] and not truth["complaint"], truth
