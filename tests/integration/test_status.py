"""`farhand status` tells troubles apart: each is planted among real processes, and it names that one and no other."""

from __future__ import annotations

import json
import signal
import socket
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from farhand.common.address import free_port
from farhand.common.impairment.link_control import RelayControl
from farhand.deploy.places import find_task
from farhand.deploy.process_discovery import find_processes
from farhand.deploy.status import DEGRADED, HEALTHY, NOT_THERE
from farhand.evaluation.harness.farhand_process import PATIENCE_S, HeardProcess
from tests.farhand_process import farhand, running

pytestmark = pytest.mark.timeout(240)


@dataclass(frozen=True)
class Place:
    """Robot, link and operator's site, each a process of its own, and their doors in a folder of their own."""

    folder: Path
    robot: HeardProcess
    link: HeardProcess
    operator: HeardProcess
    robot_port: int
    link_port: int
    control: RelayControl

    def another_operator(self, name: str, *arguments: object, port: int = 0) -> Any:
        """One more operator's site, with a data folder of its own."""
        connect = f"--connect=tcp/127.0.0.1:{port or self.link_port}"
        return running(
            "local", connect, f"--site-name={name}", f"--data-dir={self.folder / name}", *arguments
        )  # fmt: skip


def ask(*arguments: object) -> tuple[int, dict[str, Any]]:
    """The exit status and the answer of a `farhand status`."""
    done = farhand("status", "--json", *arguments)
    return done.returncode, json.loads(done.stdout)


def codes(answer: dict[str, Any]) -> set[str]:
    return {trouble["code"] for trouble in answer["troubles"]}


def await_codes(expected: set[str], *arguments: object) -> dict[str, Any]:
    """Ask until these troubles are told and no others."""
    until_s = time.monotonic() + PATIENCE_S
    while True:
        status, answer = ask(*arguments)
        if codes(answer) == expected and status == (DEGRADED if expected else HEALTHY):
            return answer
        assert time.monotonic() < until_s, f"waited for {expected or 'health'}, got {status}: {answer}"


@contextmanager
def place_in(folder: Path, task: object = "planar") -> Iterator[Place]:
    robot_port, link_port, control_port = free_port(), free_port(), free_port()
    with ExitStack() as stack:
        start = stack.enter_context
        robot = start(_robot(folder, robot_port, task))
        link = start(
            running(
                "link", f"--listen=127.0.0.1:{link_port}", f"--target=127.0.0.1:{robot_port}",
                f"--control=127.0.0.1:{control_port}", "--profile=lan",
            )
        )  # fmt: skip
        link.until("the link's control")
        operator = start(
            running(
                "local", f"--connect=tcp/127.0.0.1:{link_port}", f"--link-control=127.0.0.1:{control_port}",
                f"--task={task}", f"--data-dir={folder / 'operator'}", f"--port={free_port()}",
                "--site-name=operator",
            )
        )  # fmt: skip
        robot.until("the robot is ready")
        operator.until("the robot reports")
        control = RelayControl("127.0.0.1", control_port)
        yield Place(folder, robot, link, operator, robot_port, link_port, control)


def _robot(folder: Path, port: int, task: object = "planar") -> Any:
    return running(
        "remote", f"--listen=tcp/127.0.0.1:{port}", f"--data-dir={folder / 'robot'}", f"--task={task}"
    )


@pytest.fixture(scope="module", autouse=True)
def doors(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """The processes of these tests have a runtime folder of their own: with a long name, as some systems have."""
    folder = tmp_path_factory.mktemp("doors") / (
        "a-folder-with-a-name-that-is-longer-than-a-socket-address-" * 2
    )
    folder.mkdir()
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("FARHAND_RUNTIME_DIR", str(folder))
        yield folder


@pytest.fixture(scope="module")
def place(doors: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Place]:
    with place_in(tmp_path_factory.mktemp("place")) as place:
        yield place


@pytest.fixture(autouse=True)
def forgotten() -> Iterator[None]:
    """Whatever a test has ended is forgotten after it."""
    yield
    farhand("status", "--forget")


def test_nobody_is_there(doors: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FARHAND_RUNTIME_DIR", str(tmp_path / "never-made"))
    done = farhand("status")
    assert done.returncode == NOT_THERE
    assert done.stdout.splitlines()[-1] == "not there"


def test_all_three_are_healthy_and_say_what_they_do(place: Place) -> None:
    answer = await_codes(set())
    by_role = {each["role"]: each["status"] for each in answer["processes"]}
    assert by_role.keys() == {"robot", "link", "operator"}
    robot, link, site = (by_role[role]["facts"] for role in ("robot", "link", "operator"))
    assert robot["mode"] == site["robot_mode"] == "disarmed"
    assert robot["holder"] == "operator" and site["in_control"]
    assert 0.0 <= site["age_s"] < 1.0 and 0.0 < site["round_trip_s"] < 1.0
    assert robot["tick_age_s"] < 1.0 and robot["control_hz"] > 0.0
    assert link["connections"] == 1 and link["outage"] == "none"
    for process, role in ((place.robot, "robot"), (place.link, "link"), (place.operator, "operator")):
        status = by_role[role]
        assert status["pid"] == process.pid and status["uptime_s"] > 0.0
        assert status["version"] and status["schema"] >= 1
        assert farhand("status", "--of", role).returncode == HEALTHY


def test_a_cut_link(place: Place) -> None:
    place.control.outage("stall", 600.0)
    await_codes({"link-cut"})
    assert farhand("status", "--of", "robot").returncode == HEALTHY
    place.control.clear()
    await_codes(set())


def test_an_operator_without_the_lease(place: Place) -> None:
    await_codes(set())
    with place.another_operator("second") as second:
        second.until("the robot reports")
        answer = await_codes({"no-lease"})
    assert answer["troubles"][0]["name"] == "second"
    assert "operator" in answer["troubles"][0]["text"]


def test_a_robot_that_is_suspended_is_stale(place: Place) -> None:
    place.robot.send(signal.SIGSTOP)
    answer = await_codes({"stale"})
    assert {trouble["role"] for trouble in answer["troubles"]} == {"robot"}
    assert farhand("status", "--of", "robot").returncode == NOT_THERE
    place.robot.send(signal.SIGCONT)
    await_codes(set())


def test_what_the_operators_site_alone_can_tell_of_a_suspended_robot(
    place: Place, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """As on two machines: its own doors show one process."""
    monkeypatch.setenv("FARHAND_RUNTIME_DIR", str(tmp_path))
    with place.another_operator("far-away", "--watch") as site:
        site.until("the robot reports")
        await_codes(set())
        place.robot.send(signal.SIGSTOP)
        await_codes({"stale"})
        place.robot.send(signal.SIGCONT)
        await_codes(set())


def test_a_full_disk(place: Place) -> None:
    log = place.folder / "writer" / "operator" / "writer" / "events.jsonl"
    log.parent.mkdir(parents=True)
    log.symlink_to("/dev/full")
    with place.another_operator("writer", "--watch") as site:
        site.until("the robot reports")
        answer = await_codes({"disk-full"})
    assert "No space left" in answer["troubles"][0]["text"]


def test_a_wrong_task(place: Place, tmp_path: Path) -> None:
    other = tmp_path / "other.toml"
    shipped = Path(find_task.__code__.co_filename).with_name("tasks") / "planar.toml"
    other.write_text(shipped.read_text().replace('name = "planar"', 'name = "another"'))
    with place.another_operator("elsewhere", f"--task={other}", "--watch") as site:
        site.until("the robot reports")
        answer = await_codes({"wrong-task"})
    assert "planar" in answer["troubles"][0]["text"] and "another" in answer["troubles"][0]["text"]


@pytest.mark.parametrize("role", ["remote", "link", "local"])
def test_a_taken_port(place: Place, role: str) -> None:
    with socket.socket() as holder:
        holder.bind(("127.0.0.1", 0))
        holder.listen()
        port = holder.getsockname()[1]
        arguments = {
            "remote": (f"--listen=tcp/127.0.0.1:{port}", f"--data-dir={place.folder / 'taken'}"),
            "link": (f"--listen=127.0.0.1:{port}", "--control=127.0.0.1:0"),
            "local": (f"--port={port}", f"--data-dir={place.folder / 'taken'}", "--site-name=taken"),
        }
        assert farhand(role, *arguments[role]).returncode == 1
    answer = await_codes({"port-taken"})
    assert str(port) in answer["troubles"][0]["text"]


@pytest.mark.parametrize("of_it_alone", [False, True], ids=["beside the robot", "as on another machine"])
def test_another_version(
    place: Place, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, of_it_alone: bool
) -> None:
    installed = tmp_path / "farhand-99.0.0.dist-info"
    installed.mkdir()
    (installed / "METADATA").write_text("Metadata-Version: 2.1\nName: farhand\nVersion: 99.0.0\n")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    if of_it_alone:
        monkeypatch.setenv("FARHAND_RUNTIME_DIR", str(tmp_path))
    with place.another_operator("newer", "--watch") as newer:
        newer.until("the robot reports")
        assert "99.0.0" in await_codes({"version-differs"})["troubles"][0]["text"]


def test_a_page_without_a_robot(place: Place) -> None:
    nobody = free_port()
    with place.another_operator(
        "lonely", f"--port={free_port()}", "--connect-timeout-s=0", port=nobody
    ) as site:
        site.until("without a time limit")
        answer = await_codes({"page-only"})
        assert str(nobody) in answer["troubles"][0]["text"]
        with _robot(place.folder / "late", nobody) as robot:
            robot.until("the robot is ready")
            site.until("the robot reports")
            await_codes(set())


def test_a_robot_that_its_guard_has_stopped(
    doors: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FARHAND_RUNTIME_DIR", str(tmp_path))
    port = free_port()
    with _robot(tmp_path, port) as robot:
        connect, data = f"--connect=tcp/127.0.0.1:{port}", f"--data-dir={tmp_path / 'operator'}"
        with running("local", connect, data, "--demo", "--task=planar") as script:
            script.until("the robot is in AUTONOMOUS")
            robot.send(signal.SIGSTOP)
            # It does not answer in two seconds, which is four times its deadline.
            assert farhand("status", "--of", "robot").returncode == NOT_THERE
            robot.send(signal.SIGCONT)
            answer = await_codes({"robot-stopped"}, "--of", "robot")
    assert "late" in answer["troubles"][0]["text"]


def test_a_robot_that_was_killed(place: Place) -> None:
    place.robot.kill()
    await_codes({"robot-dead"})
    assert farhand("status", "--of", "robot").returncode == NOT_THERE
    with _robot(place.folder, place.robot_port) as robot:
        robot.until("the robot is ready")
        await_codes(set())
        assert robot.pid in {entry.pid for entry in find_processes()}
    await_codes({"robot-dead"})


def test_a_link_that_was_killed(place: Place) -> None:
    place.link.kill()
    await_codes({"link-dead"})
