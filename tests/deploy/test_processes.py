"""Each process starts alone, ends in order on a signal, and tells in one line why it cannot run."""

from __future__ import annotations

import signal
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from farhand.common.address import free_port
from farhand.evaluation.harness.farhand_process import HeardProcess
from tests.farhand_process import refusal, running

SIGNALS = (signal.SIGINT, signal.SIGTERM)


@pytest.fixture
def taken_port() -> Iterator[int]:
    with socket.socket() as holder:
        holder.bind(("127.0.0.1", 0))
        holder.listen()
        yield holder.getsockname()[1]


@pytest.fixture(scope="module")
def remote() -> Iterator[str]:
    """The endpoint of a robot."""
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    with running("remote", f"--listen={endpoint}") as process:
        process.until("the robot is ready")
        yield endpoint


def assert_ends_in_order(process: HeardProcess, number: signal.Signals) -> None:
    process.send(number)
    assert process.wait() == 0, process.words
    assert "Traceback" not in process.words
    assert "farhand:" not in process.words


@pytest.mark.parametrize("number", SIGNALS)
def test_the_remote_site_ends_on_a_signal(number):
    with running("remote", f"--listen=tcp/127.0.0.1:{free_port()}") as process:
        process.until("the robot is ready")
        assert_ends_in_order(process, number)


@pytest.mark.parametrize("number", SIGNALS)
def test_the_link_ends_on_a_signal(number):
    with running("link", "--listen=127.0.0.1:0", "--control=127.0.0.1:0") as process:
        process.until("the link's control")
        assert_ends_in_order(process, number)


@pytest.mark.parametrize("number", SIGNALS)
def test_the_local_site_ends_on_a_signal(number, remote, tmp_path):
    with running("local", f"--connect={remote}", f"--data-dir={tmp_path}") as process:
        process.until("the robot reports")
        assert_ends_in_order(process, number)


def test_a_folder_has_one_owner_until_that_ends_however_it_does(tmp_path):
    nobody, folder = f"tcp/127.0.0.1:{free_port()}", f"--data-dir={tmp_path}"
    local = ("local", f"--connect={nobody}", folder, "--connect-timeout-s=30")
    with running(*local) as first:
        first.until("connecting to the robot")
        line = refusal(*local, "--site-name=another")
        assert f"process {first.pid} keeps what was taught" in line and "--data-dir" in line
    with running("remote", f"--listen=tcp/127.0.0.1:{free_port()}", folder) as robot:
        robot.until("the robot is ready")
        line = refusal("remote", f"--listen=tcp/127.0.0.1:{free_port()}", folder)
        assert f"process {robot.pid} keeps the state" in line
    with running(*local) as later:  # the one before was killed
        later.until("connecting to the robot")


@pytest.mark.parametrize("number", SIGNALS)
def test_the_local_site_ends_on_a_signal_while_it_waits_for_the_robot(number, tmp_path):
    nobody = f"tcp/127.0.0.1:{free_port()}"
    with running("local", f"--connect={nobody}", f"--data-dir={tmp_path}") as process:
        process.until("connecting to the robot")
        assert_ends_in_order(process, number)


def test_a_port_in_use_is_named(taken_port):
    held, free = f"127.0.0.1:{taken_port}", "127.0.0.1:0"
    for command in (
        ["remote", f"--listen=tcp/{held}"],
        ["link", f"--listen={held}", f"--control={free}"],
        ["link", f"--listen={free}", f"--control={held}"],
        ["up", f"--port={taken_port}"],
    ):
        line = refusal(*command)
        assert str(taken_port) in line and "in use" in line


def test_a_robot_that_cannot_be_reached_is_named(tmp_path):
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    line = refusal("local", f"--connect={endpoint}", "--connect-timeout-s=0.5", f"--data-dir={tmp_path}")
    assert endpoint in line and "is the remote site running" in line


@pytest.mark.parametrize("site", ["remote", "local"])
@pytest.mark.parametrize(
    ("content", "expected"),
    [
        ('tsk = "planar"', ["unknown field", "tsk"]),
        ("[link]\nlease_s = nan", ["link.lease_s", "finite"]),
        ('seed = "one"', ["seed", "`int`", "`str`"]),
        ("seed = -1", ["seed", ">= 0"]),
        ("seed = [", ["TOML"]),
    ],
)
def test_a_bad_configuration_is_refused_with_its_file_and_field(site, content, expected, tmp_path):
    file = tmp_path / "site.toml"
    file.write_text(content)
    line = refusal(site, f"--config={file}")
    assert str(file) in line
    assert all(word in line for word in expected), line


def test_a_configuration_that_is_not_there_is_named(tmp_path):
    assert "none.toml: a readable file" in refusal("remote", f"--config={tmp_path / 'none.toml'}")


@pytest.mark.parametrize("command", ["remote", "local", "demo", "up"])
def test_an_unknown_task_is_refused_with_those_there_are(command):
    line = refusal(command, "--task=juggling")
    assert "juggling" in line and "planar" in line


def test_a_malformed_task_file_is_refused_with_its_field(tmp_path):
    task = tmp_path / "task.toml"
    shipped = Path(__file__).parents[2] / "deploy" / "tasks" / "planar.toml"
    task.write_text(shipped.read_text().replace("start_m = [0.15, 0.75]", "start_m = [0.15, inf]"))
    line = refusal("remote", f"--task={task}")
    assert str(task) in line and "start_m[1]" in line and "finite" in line


def test_what_the_command_line_gets_wrong_is_said_before_anything_starts(tmp_path):
    assert "profile" in refusal("demo", "--link=pigeon")
    assert "outage" in refusal("demo", "--outage=reset:soon")
    assert "json" in refusal("demo", f"--json={tmp_path}/nowhere/result.json")
    assert "json" in refusal("demo", f"--json={tmp_path}")
    assert "listen" in refusal("link", "--listen=7448")
    assert "connect_timeout_s" in refusal("local", "--connect-timeout-s=nan")
    assert "link_control" in refusal("local", "--demo", "--link-control=7449", f"--data-dir={tmp_path}")
