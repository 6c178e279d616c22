"""A robot of one's own outside of this repository: installed beside Farhand, found by its names, and doing the job."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from examples.my_table.my_table import Camera, Table
from farhand.deploy.places import find_point_task
from farhand.testing import check_perception, check_plant
from tests.farhand_process import farhand

EXAMPLE = Path(__file__).parents[2] / "examples" / "my_table"
PAGE = Path(__file__).parents[2] / "docs" / "extending.md"


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder into which pip has installed the example, without a network."""
    folder = tmp_path_factory.mktemp("installed")
    pip = [
        sys.executable,
        "-m",
        "pip",
        "install",
        "--quiet",
        "--no-index",
        "--no-deps",
        "--no-build-isolation",
    ]
    subprocess.run([*pip, "--target", str(folder), str(EXAMPLE)], check=True)
    return folder


def test_it_is_sound_and_short():
    task = find_point_task("planar")
    limits = {"max_speed_m_s": task.limits.speed_m_s, "max_acceleration_m_s2": task.limits.acceleration_m_s2}
    check_plant(Table(task, {}), **limits, pace=lambda _: None)
    check_perception(Camera(task, {}), n_dims=task.n_dims, duration_s=0.1, pace=lambda _: None)
    code = (EXAMPLE / "my_table.py").read_text(encoding="utf-8")
    assert len([line for line in code.splitlines() if line.strip()]) < 40
    assert code in PAGE.read_text(encoding="utf-8")
    assert (EXAMPLE / "pyproject.toml").read_text(encoding="utf-8") in PAGE.read_text(encoding="utf-8")


def test_a_demo_does_the_job_with_it_and_says_that_nobody_can_judge(
    installed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv("PYTHONPATH", str(installed))
    config, result = tmp_path / "remote.toml", tmp_path / "result.json"
    config.write_text('[perception]\nuse = "my-camera"\noptions = { origin_m = [0.55, 0.40] }\n')
    done = farhand(
        "demo", "--task", "planar", "--link", "lan", "--plant", "my-table", "--remote-config", config,
        "--json", result,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "task planar: DONE, NOT JUDGED" in done.stderr and "Traceback" not in done.stderr
    told = json.loads(result.read_text(encoding="utf-8"))
    assert told["success"] is None and told["execution"]["rms_error_m"] is None
    assert told["execution"]["duration_s"] > 0.0 and told["execution"]["rms_over_s"] >= 10.0 - 1e-6


def test_with_the_simulated_target_the_same_table_is_judged(
    installed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv("PYTHONPATH", str(installed))
    result = tmp_path / "result.json"
    done = farhand(
        "demo", "--task", "planar", "--link", "lan", "--plant", "my-table", "--json", result
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert json.loads(result.read_text(encoding="utf-8"))["success"] is True
