"""All bad peers at one robot's process, by the code of the study, over a quick link."""

from __future__ import annotations

from pathlib import Path

from farhand.evaluation.harness.bad_peers import PEERS
from farhand.evaluation.link.bad_peers import attempt, bench_in, commands_run, summarise


def test_each_bad_peer_is_refused_by_its_reason_on_both_sides_and_runs_no_command(tmp_path: Path):
    with bench_in(tmp_path, "lan") as (bench, robot):
        found = {name: attempt(bench, robot, name, 60.0) for name in PEERS}
        robot.end()
    assert {name: (each["site"], each["robot"]) for name, each in found.items()} == dict.fromkeys(
        PEERS, (True, True)
    )
    assert all(took_s is not None for each in found.values() for took_s in each["stops_s"])
    assert commands_run(tmp_path / "robot" / "robot" / "rov1" / "events.jsonl") == 0


def test_a_reason_that_is_not_said_or_a_command_that_runs_fails_the_study():
    good = {"site": True, "robot": True, "ran": 0, "left_out": 0, "left_out_idle": 0, "stops_s": []}
    for changed, passes in (
        ({}, True),
        ({"site": False}, False),
        ({"ran": 1}, False),
        ({"stops_s": [None]}, False),
    ):
        summary, _ = summarise([{"peer": "expired", "trials": 1, "tries": [good | changed]}])
        assert summary["passed"] is passes
