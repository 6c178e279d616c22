"""Processes of a hub, a robot and an operator: the job is done through the hub, and goes on when the hub is killed."""

from __future__ import annotations

import json
import time
from pathlib import Path

from farhand.common.address import free_port
from farhand.deploy.pki.registry import Registry
from farhand.evaluation.harness.farhand_process import PATIENCE_S
from tests.farhand_process import farhand, refusal, running

HOST = "127.0.0.1"


def test_a_robot_whose_hub_is_killed_finishes_its_execution_and_is_reached_again(tmp_path: Path):
    registry = Registry.create(tmp_path / "pki", "fleet")
    hub_folder = registry.issue("shore-hub", "hub", (HOST,), 30)
    robot, mine = registry.issue("rov2", "robot", (), 30), registry.issue("shore-1", "operator", (), 30)
    where = f"quic/{HOST}:{free_port('quic')}"
    hub = ["hub", "--listen", where, "--certificates", hub_folder, "--sites", tmp_path / "pki/sites.json"]
    with (
        running(
            "remote", "--connect", where, "--vehicle", "rov2", "--certificates", robot, "--task", "planar",
            "--data-dir", tmp_path / "robot",
        ),
        running(*hub) as first,
        running(
            "local", "--demo", "--connect", where, "--robots", "rov2", "--certificates", mine,
            "--task", "planar", "--data-dir", tmp_path / "operator", "--json", tmp_path / "result.json",
        ) as shore,
    ):  # fmt: skip
        shore.until("execute: the robot is in AUTONOMOUS")
        listed = farhand("status", "--connect", where, "--certificates", mine)
        assert (listed.returncode, listed.stdout.partition(" approach")[0][:16]) == (0, "rov2: autonomous")
        assert "shore-1 in control" in listed.stdout
        first.kill()
        log = tmp_path / "robot" / "robot" / "rov2" / "events.jsonl"
        wait_for_completion(log)
        with running(*hub):
            assert shore.wait() == 0
    assert json.loads((tmp_path / "result.json").read_text())["success"]


def wait_for_completion(log: Path) -> None:
    until_s, events = time.monotonic() + PATIENCE_S, []
    while not any((e["kind"], e.get("action")) == ("completed", "execute") for e in events):
        assert time.monotonic() < until_s, events
        time.sleep(0.05)
        events = [json.loads(line) for line in log.read_text().splitlines()]


def test_a_hub_that_could_not_tell_robots_from_operators_does_not_start(tmp_path: Path):
    assert "quic/ or tls/ and --certificates" in refusal("hub", "--listen", "tcp/0.0.0.0:7450")
    registry = Registry.create(tmp_path / "pki", "fleet")
    folder = registry.issue("hub", "hub", (HOST,), 30)
    words = refusal("hub", "--listen", f"quic/{HOST}:7450", "--certificates", folder)
    assert "sites" in words and "sites.json" in words


def test_a_robot_listens_or_connects_and_does_not_do_both():
    words = refusal("remote", "--listen", f"tcp/{HOST}:7447", "--connect", f"tcp/{HOST}:7450")
    assert "or else link.connect: the endpoint of a hub; got both" in words


def test_the_robot_that_the_page_is_for_has_a_name_that_can_be_a_key(tmp_path: Path):
    done = farhand("local", "--connect", f"tcp/{HOST}:7450", "--robots", "rov 1", "--data-dir", tmp_path)
    assert done.returncode == 2
    assert "robots" in done.stderr or "vehicle" in done.stderr
