"""`farhand pki` as a person types it, in a process of its own."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

from farhand.deploy.entry import own_command


def pki(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    words = own_command("pki", *arguments, "--folder", str(folder))
    return subprocess.run(words, check=False, capture_output=True, text=True, timeout=60)


def test_from_nothing_to_a_renewed_robot_and_a_revoked_observer(tmp_path: Path):
    folder = tmp_path / "pki"
    missing = pki(folder, "robot", "rov1", "--san", "rov1.example")
    assert missing.returncode == 2
    assert "farhand pki init" in missing.stderr

    for arguments in (
        ("init", "--name", "fleet"),
        ("robot", "rov1", "--san", "rov1.example", "10.0.0.5", "--days", "3"),
        ("operator", "shore-1"),
        ("operator", "guest", "--observer", "--days", "30"),
        ("revoke", "guest"),
    ):
        done = pki(folder, *arguments)
        assert (done.returncode, done.stderr) == (0, ""), arguments
    shown = pki(folder, "show")
    assert shown.returncode == 3  # the robot's certificate ends soon
    assert "rov1: robot, dialled as rov1.example, 10.0.0.5; valid until " in shown.stdout
    assert "guest: observer; revoked on " in shown.stdout

    assert pki(folder, "renew", "rov1").returncode == 0
    listed = pki(folder, "show", "--json")
    assert listed.returncode == 0
    rows = {row["name"]: row for row in json.loads(listed.stdout)}
    assert {name: row["role"] for name, row in rows.items()} == {
        "rov1": "robot", "shore-1": "operator", "guest": "observer",
    }  # fmt: skip
    assert "364 days left" in rows["rov1"]["state"]
    assert "89 days left" in rows["shore-1"]["state"]

    (folder / "sites" / "shore-1" / "certificate.pem").write_bytes(b"")
    shown = pki(folder, "show")
    assert (
        shown.returncode == 3 and "shore-1: operator; " in shown.stdout and "certificate.pem" in shown.stdout
    )
