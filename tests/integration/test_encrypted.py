"""Processes over an encrypted link: what a refused operator says, and what a revocation leaves alone."""

from __future__ import annotations

import json
import shutil
import time
from pathlib import Path

import pytest

from farhand.common.address import free_port
from farhand.common.link.endpoint import EndpointSettings
from farhand.common.link.link import ZenohLink
from farhand.deploy.pki.registry import Registry
from farhand.evaluation.harness.farhand_process import PATIENCE_S
from tests.farhand_process import farhand, running

HOST = "127.0.0.1"


@pytest.mark.parametrize(
    ("dialled", "words"),
    [
        (HOST, "does its list of sites name shore-1, and not as revoked?"),
        ("localhost", "the robot's certificate is not for localhost"),
    ],
)
def test_the_operators_process_says_why_when_it_gives_up(tmp_path: Path, dialled: str, words: str):
    registry = Registry.create(tmp_path / "pki", "fleet")
    robot, mine = registry.issue("rov1", "robot", (HOST,), 30), registry.issue("shore-1", "operator", (), 30)
    list_of_sites = tmp_path / "sites.json"
    list_of_sites.write_text('{"somebody-else": {"role": "operator"}}')
    port = free_port("quic")
    link = ZenohLink(
        EndpointSettings(listen=f"quic/{HOST}:{port}", certificates=str(robot), sites=str(list_of_sites))
    )
    try:
        done = farhand(
            "local", "--connect", f"quic/{dialled}:{port}", "--certificates", mine,
            "--data-dir", tmp_path / "data", "--connect-timeout-s", "3",
        )  # fmt: skip
    finally:
        link.close()
    assert done.returncode == 1
    assert words in done.stderr.splitlines()[-1]


def test_an_execution_whose_operator_is_revoked_goes_on_to_its_end_and_the_operator_is_told(tmp_path: Path):
    registry = Registry.create(tmp_path / "pki", "fleet")
    robot, issued = (
        registry.issue("rov1", "robot", (HOST,), 30),
        registry.issue("shore-1", "operator", (), 30),
    )
    mine = shutil.copytree(issued, tmp_path / "shore-1")  # a revocation deletes the key that was issued
    endpoint = f"quic/{HOST}:{free_port('quic')}"
    with (
        running(
            "remote", "--listen", endpoint, "--task", "planar", "--certificates", robot,
            "--sites", tmp_path / "pki" / "sites.json", "--data-dir", tmp_path / "robot",
        ) as rov,
        running(
            "local", "--demo", "--connect", endpoint, "--task", "planar", "--certificates", mine,
            "--site-name", "shore-1", "--data-dir", tmp_path / "operator",
        ) as shore,
    ):  # fmt: skip
        shore.until("execute: the robot is in AUTONOMOUS")
        registry.revoke("shore-1")
        rov.until("the link is opened again")
        log = tmp_path / "robot" / "robot" / "rov1" / "events.jsonl"
        until_s, events, arrived = time.monotonic() + PATIENCE_S, [], []
        while not arrived:
            assert time.monotonic() < until_s, events
            events = [json.loads(line) for line in log.read_text().splitlines()]
            arrived = [e for e in events if (e["kind"], e.get("action")) == ("completed", "execute")]
        shore.until("the robot refuses this site: shore-1 was revoked on")
        assert shore.wait() == 1
    assert arrived[0]["succeeded"]
    assert not {"disarmed", "stopped", "paused"} & {event["kind"] for event in events}
