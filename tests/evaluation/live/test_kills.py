from __future__ import annotations

from farhand.evaluation.live import kills


def test_every_site_is_killed_in_every_mode_at_moments_of_its_own():
    cases = kills.cases(3, 0)
    assert [(case["whom"], case["mode"]) for case in cases] == 3 * kills._KILLS
    moments = [case["at"] for case in cases]
    assert len(set(moments)) == 12 and all(0.0 <= at < 1.0 for at in moments)


def test_a_broken_rule_is_told_with_its_kill():
    kill = {
        "task": "hot-stab", "whom": "robot", "mode": "direct", "seed": 7, "at": 0.5, "broken": ["it moves"],
        "scheduling": "niceness 0", "load": 0.1,
    }  # fmt: skip
    summary, markdown = kills.summarise([kill])
    assert not summary["passed"] and "- robot, direct, seed 7, at 0.50, load 0.1: it moves" in markdown
    assert kills.summarise([{**kill, "broken": []}])[0]["passed"]


def test_a_robot_that_is_killed_comes_back_by_the_rules_and_so_does_its_operator():
    kill = {"task": "planar", "whom": "robot", "mode": "direct", "seed": 1, "at": 0.5}
    assert kills.trial(kill)["broken"] == []
