"""The page about recordings: its commands turn a hand-held motion capture into a model that seats a plug."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import numpy as np
import pytest

from farhand.common.model.model_file import load
from farhand.deploy.places import sample_files
from farhand.evaluation.arm.arm_trial import Conditions, Trial
from farhand.local_site.teaching.demonstration import Demonstration
from farhand.remote_site.perception.simulated_sight import PRESETS
from tests.examples.takes import EVERY, FOLDER, N_TAKES, take
from tests.farhand_process import farhand

ROOT = Path(__file__).parents[2]
COMPILES_S = 400
pytestmark = pytest.mark.timeout(COMPILES_S)  # where nothing is compiled yet, the commands do it
PAGE = (ROOT / "docs" / "recordings.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def said(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[str]]:
    """The folder in which the commands of the page were run, and what each said."""
    folder = tmp_path_factory.mktemp("page")
    (folder / "examples").symlink_to(ROOT / "examples")
    (block,) = re.findall(r"```sh\n(.*?)```", PAGE, re.DOTALL)
    answers = list[str]()
    for line in block.replace("\\\n", " ").splitlines():
        program, *words = shlex.split(line)
        assert program == "farhand"
        paths = [sorted(map(str, folder.glob(word))) if "*" in word else [word] for word in words]
        done = farhand(*(word for each in paths for word in each), cwd=folder, timeout_s=COMPILES_S)
        assert done.returncode == 0, done.stderr
        answers.append(done.stdout)
    return folder, answers


def test_the_takes_are_what_a_motion_capture_of_the_demonstrations_would_write():
    for n in range(1, N_TAKES + 1):
        assert (FOLDER / f"take-{n}.csv").read_bytes().decode() == take(n)


def test_every_command_of_the_page_runs_and_the_preview_says_what_the_page_shows(said):
    (shown,) = re.findall(r"```text\n(.*?)```", PAGE, re.DOTALL)
    assert shown.strip() in said[1][0]
    assert "gave up" not in said[1][-1]


def test_the_tip_is_seen_from_the_receptacle_as_the_operator_showed_it(said):
    for n in range(1, N_TAKES + 1):
        made = Demonstration.load(said[0] / "taught" / f"take-{n}_01.npz")
        shown = Demonstration.load(sample_files("hot-stab")[n - 1]).thinned(EVERY)
        same = np.isin(np.round(shown.time_s, 3), np.round(made.time_s, 3))
        assert same.sum() == len(made.time_s) == len(shown.time_s) - 4
        apart_m = np.linalg.norm(made.in_frame() - shown.in_frame()[same], axis=1)
        assert np.sqrt(np.mean(apart_m**2)) < 2e-3  # 0.1 degrees at 0.3 m, and twice 0.2 mm


def test_the_model_seats_the_plug_of_the_robots_arm(said):
    record = Trial(load(said[0] / "hot-stab.model"), Conditions(noise=PRESETS["clean"]), seed=1).run()
    assert record.success, record.cause
