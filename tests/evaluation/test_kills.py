from __future__ import annotations

from evaluation import kills


def test_every_site_is_killed_in_every_mode_at_moments_of_its_own():
    (case,) = kills.cases(3, 0)
    assert [(kill["whom"], kill["mode"]) for kill in case["kills"]] == 3 * kills._KILLS
    moments = [kill["at"] for kill in case["kills"]]
    assert len(set(moments)) == 12 and all(0.0 <= at < 1.0 for at in moments)


def test_a_broken_rule_is_told_with_its_kill():
    kill = {"whom": "robot", "mode": "direct", "seed": 7, "at": 0.5, "broken": ["it moves"]}
    result = {"kills": [kill], "scheduling": "niceness 0", "load": 0.1, "task": "planar"}
    summary, markdown = kills.summarise([result])
    assert not summary["passed"] and "- robot, direct, seed 7, at 0.50: it moves" in markdown
    assert kills.summarise([{**result, "kills": [{**kill, "broken": []}]}])[0]["passed"]


def test_a_robot_that_is_killed_comes_back_by_the_rules_and_so_does_its_operator():
    kill = {"whom": "robot", "mode": "direct", "seed": 1, "at": 0.5}
    assert kills._told(kill, "planar") == {"broken": []}
