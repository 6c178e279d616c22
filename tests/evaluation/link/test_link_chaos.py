"""One in a hundred of the schedules of `farhand evaluate link-chaos`, and what the study promises."""

from __future__ import annotations

import json

import pytest

from farhand.common.mode_table import Action, ControlMode
from farhand.evaluation.link import link_chaos
from farhand.evaluation.link.chaos import random_schedule
from farhand.evaluation.study import run
from farhand.remote_site.supervision.freshness import Freshness, Verdict
from farhand.remote_site.supervision.mode_machine import ModeMachine

COMPARABLE = ("violations", "virtual_s", "periods", "transitions", "n_arrived", "n_ran")


@pytest.mark.timeout(900)
def test_every_invariant_holds_on_one_per_cent_of_the_schedules(tmp_path):
    record = json.loads(run("link-chaos", link_chaos.TRIALS // 100, 0, tmp_path, "test").read_text())
    summary = record["summary"]
    assert summary["failing_seeds"] == [], (tmp_path / "link-chaos.md").read_text()
    assert summary["trials"] == 100
    # The schedules reach what they are to put to the test.
    assert set(summary["periods_by_mode"]) == set(ControlMode)
    assert summary["commands_done"] > 300
    assert len(summary["transitions"]) > 15


def test_the_same_seed_gives_the_same_run():
    first, second = (link_chaos.trial({"seed": 7}) for _ in range(2))
    assert [first[name] for name in COMPARABLE] == [second[name] for name in COMPARABLE]


def test_seeds_count_from_the_one_given():
    assert link_chaos.cases(3, 40) == [{"seed": 40}, {"seed": 41}, {"seed": 42}]
    assert random_schedule(40).mishaps == random_schedule(40).mishaps
    assert random_schedule(40).mishaps != random_schedule(41).mishaps


def violated(seeds: range) -> set[str]:
    """Numbers of the invariants that these seeds violate."""
    return {each["invariant"] for seed in seeds for each in link_chaos.trial({"seed": seed})["violations"]}


def test_a_robot_that_takes_messages_of_any_age_is_found_out(monkeypatch):
    monkeypatch.setattr(Freshness, "judge", lambda *_, **__: Verdict(None, 0.1))
    assert "7" in violated(range(8))


def test_a_robot_that_forgets_a_stop_is_found_out(monkeypatch):
    enter = ModeMachine._enter

    def forgetful(self, cause, why):
        if cause is not Action.STOP:
            enter(self, cause, why)

    monkeypatch.setattr(ModeMachine, "_enter", forgetful)
    assert {"3", "8"} <= violated(range(3))
