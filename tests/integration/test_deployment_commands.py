"""The commands of docs/deployment.md, from no certificate to a plug that is seated, run as they stand there."""

from __future__ import annotations

import shlex
import subprocess
from pathlib import Path

import pytest

from farhand.common.address import free_port
from tests.farhand_process import farhand, running

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "deployment.md").read_text(encoding="utf-8")


def commands(home: Path, port: int) -> list[list[str]]:
    """The commands under "Two machines", with this machine's address and a home of their own."""
    block = PAGE.partition("\n## Two machines\n")[2].partition("```sh\n")[2].partition("```")[0]
    here = (
        ("quic/rov1.example:7447", f"quic/127.0.0.1:{port}"), ("rov1.example", "127.0.0.1"),
        ("~/.local/share", str(home)), ("deploy/", f"{ROOT / 'deploy'}/"),
    )  # fmt: skip
    for old, new in here:
        assert old in block
        block = block.replace(old, new)
    return [shlex.split(line) for line in block.splitlines() if line and not line.startswith("#")]


@pytest.mark.soak
def test_the_commands_of_the_page_seat_the_plug(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "home"))
    monkeypatch.chdir(tmp_path)
    port = free_port("quic")
    *before, remote, local = commands(tmp_path / "home", port)
    assert len(before) + 2 <= 10 and remote[1] == "remote" and local[1] == "local"
    for command in before:
        if command[0] == "cp":
            subprocess.run(command, check=True)
        else:
            assert farhand(*command[1:]).returncode == 0
    with running(*remote[1:], f"--listen=quic/127.0.0.1:{port}", f"--data-dir={tmp_path / 'robot'}") as robot:
        robot.until("the robot is ready")
        done = farhand(*local[1:], "--demo", "--port=0", f"--data-dir={tmp_path / 'operator'}")
    assert done.returncode == 0, done.stderr
