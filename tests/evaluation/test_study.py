from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from farhand.common.errors import InvalidConfiguration
from farhand.evaluation import study, study_record
from farhand.evaluation.live import neighbours
from farhand.evaluation.study import chosen, reporting_seeds, run, tuning_seeds
from farhand.evaluation.study_record import FinishedTrials
from tests.evaluation import coins, lingering
from tests.farhand_process import await_end


@pytest.fixture(autouse=True)
def known(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(study.STUDIES, "coins", "tests.evaluation.coins")


def test_no_seed_both_tunes_and_reports_and_no_two_studies_share_one():
    tuned = {seed for choice in range(120) for seed in tuning_seeds(choice, 10**6)}
    reported = [set(reporting_seeds(choice, 10_000)) for choice in range(120)]
    assert tuned.isdisjoint(set.union(*reported))
    assert sum(map(len, reported)) == len(set.union(*reported))


def test_a_study_leaves_json_with_all_that_makes_it_repeatable(tmp_path):
    path = run("coins", 4, 3, tmp_path / "new" / "folder", "farhand evaluate coins --seed 3")
    assert path == tmp_path / "new" / "folder" / "coins.json"
    record = json.loads(path.read_text())
    assert record["study"] == "coins"
    assert record["command"] == "farhand evaluate coins --seed 3"
    assert record["seed"] == 3
    assert record["versions"]["numpy"] == np.__version__
    assert record["machine"]["cores"] == os.cpu_count()
    assert record["summary"].keys() == {"heads", "share"}
    assert record["summary"]["heads"] == sum(trial["success"] for trial in record["trials"])


def test_trials_keep_their_order_and_run_in_other_processes(tmp_path):
    trials = json.loads(run("coins", 12, 0, tmp_path, "").read_text())["trials"]
    assert [trial["seed"] for trial in trials] == list(reporting_seeds(0, 12))
    assert os.getpid() not in {trial["process"] for trial in trials}
    heads = [bool(np.random.default_rng(trial["seed"]).random() < 0.5) for trial in trials]
    assert [trial["success"] for trial in trials] == heads


@pytest.mark.parametrize("out", ["a file/results", "/proc/results"])
def test_a_folder_that_cannot_be_written_is_refused_before_the_first_trial(out: str, tmp_path: Path):
    (tmp_path / "a file").touch()
    with pytest.raises(InvalidConfiguration, match="out: a folder that can be written"):
        run("coins", 1, 0, tmp_path / out, "")


def test_what_is_not_finite_becomes_null(tmp_path):
    text = run("coins", 2, 0, tmp_path, "").read_text()
    assert "NaN" not in text
    assert [trial["undefined"] for trial in json.loads(text)["trials"]] == [None, None]


def test_a_study_leaves_markdown_that_ends_with_its_command_versions_and_machine(tmp_path):
    text = run("coins", None, 0, tmp_path, "farhand evaluate coins").with_suffix(".md").read_text()
    assert text.startswith("# Coins\n")
    assert "Command: `farhand evaluate coins`, seed 0." in text
    assert f"numpy {np.__version__}" in text
    assert f"{os.cpu_count()} cores" in text


def test_another_arm_s_record_does_not_take_the_place_of_the_usual_arm_s(tmp_path, monkeypatch):
    monkeypatch.setattr("tests.evaluation.coins.TAKES_ROBOT", True, raising=False)
    run("coins", 1, 0, tmp_path, "")
    for robot, own_arm, folder in (
        ("panda", "", "panda"), ("my/arm.toml", "jaco", "arm-taught-on-jaco"), ("", "jaco", "taught-on-jaco"),
    ):  # fmt: skip
        path = run("coins", 1, 0, tmp_path, "", robot, own_arm)
        assert path == tmp_path / folder / "coins.json"
        assert path.with_suffix(".md").read_text().startswith(f"# Coins: {folder}\n\n")
    assert (tmp_path / "coins.md").read_text().startswith("# Coins\n")


def test_a_trial_that_fails_ends_the_study_and_leaves_nothing(tmp_path):
    with pytest.raises(InvalidConfiguration, match="coin: edge: a side"):
        run("coins", 3, 13, tmp_path / "results", "")
    assert not (tmp_path / "results").exists()


def test_a_study_does_not_wait_for_threads_that_its_trials_left_behind(tmp_path, monkeypatch):
    monkeypatch.setitem(study.STUDIES, "lingering", "tests.evaluation.lingering")
    began_s = time.monotonic()
    run("lingering", 1, 0, tmp_path, "")
    assert time.monotonic() - began_s < lingering.LASTS_S / 2


def test_a_long_study_that_was_stopped_goes_on_where_it_was_and_leaves_its_record_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    def stopped(_results: list[dict]) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(coins, "GOES_ON", True, raising=False)
    kept = tmp_path / "coins.trials.jsonl"
    with monkeypatch.context() as at_first:
        at_first.setattr(coins, "summarise", stopped)
        with pytest.raises(KeyboardInterrupt):
            run("coins", 3, 0, tmp_path, "")
    before = {trial["seed"]: trial for trial in map(_result, kept.read_bytes().splitlines()[1:])}
    kept.write_bytes(kept.read_bytes() + b'{"case": {"seed": 100')  # its writer was killed in the middle

    trials = json.loads(run("coins", 5, 0, tmp_path, "").read_text())["trials"]
    assert [trial["seed"] for trial in trials] == list(reporting_seeds(0, 5))
    assert len(before) == 3 and [t["process"] for t in trials[:3]] == [
        before[t["seed"]]["process"] for t in trials[:3]
    ]
    assert {trial["process"] for trial in trials[3:]}.isdisjoint(t["process"] for t in before.values())
    assert sorted(file.name for file in tmp_path.iterdir()) == ["coins.json", "coins.md"]


def test_of_a_study_that_was_stopped_nothing_counts_once_the_code_is_another(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    case = {"seed": 1}
    FinishedTrials("coins", tmp_path).add(case, {"success": True})
    assert FinishedTrials("coins", tmp_path).get(case) == {"success": True}
    monkeypatch.setattr(study_record, "_code_hash", lambda: "another")
    assert FinishedTrials("coins", tmp_path).get(case) is None


def _result(line: bytes) -> dict:
    return json.loads(line)["result"]


@pytest.mark.parametrize(
    ("name", "trials", "seed", "field"),
    [("dice", 1, 0, "study"), ("coins", 0, 0, "trials"), ("coins", 1, -1, "seed")],
)
def test_a_wrong_question_is_refused_with_its_field(name, trials, seed, field, tmp_path):
    with pytest.raises(InvalidConfiguration) as caught:
        run(name, trials, seed, tmp_path / "results", "")
    assert caught.value.field == field
    assert not (tmp_path / "results").exists()


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT])
def test_a_study_that_is_killed_or_interrupted_ends_with_its_workers_in_the_middle_of_a_trial(
    tmp_path, number
):
    command = [sys.executable, "-m", "tests.evaluation.waiting", str(tmp_path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as parent:
        assert parent.stdout is not None
        worker = int(parent.stdout.readline())
        parent.send_signal(number)
        await_end(worker)
        assert parent.wait(60.0) != 0


def test_of_a_study_the_chosen_rows_alone_are_run_and_an_unknown_word_lists_those_there_are():
    cases = neighbours.cases(5, 0)
    assert chosen(cases, None) == cases
    assert [case["neighbour"] for case in chosen(cases, "garbage")] == ["garbage"]
    with pytest.raises(InvalidConfiguration, match=r"only: one of .*garbage, .*nobody, .*got 'rubbish'"):
        chosen(cases, "rubbish")
