"""What an operator's process says when the robot refuses it over an encrypted link."""

from __future__ import annotations

from pathlib import Path

import pytest

from farhand.common.address import free_port
from farhand.common.link.endpoint import EndpointSettings
from farhand.common.link.link import ZenohLink
from farhand.deploy.pki.registry import Registry
from tests.farhand_process import farhand

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
