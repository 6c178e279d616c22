"""The table across arms: all pairs with the same seeds; what the pre-flight check refuses counts apart."""

from __future__ import annotations

from typing import Any

from farhand.deploy.places import robot_names
from farhand.evaluation.arm import cross_arms
from farhand.evaluation.study import chosen, reporting_seeds


def test_every_arm_executes_what_every_arm_was_taught():
    cases = cross_arms.cases(3, 0)
    names = robot_names()
    assert {"jaco", "panda", "panda-urdf", "baxter-left", "baxter-right", "ur5e"} <= set(names)
    assert {(case["own_arm"], case["arm"]) for case in cases} == {(a, b) for a in names for b in names}
    pair = chosen(cases, "baxter-left>baxter-right")
    assert [case["seed"] for case in pair] == list(reporting_seeds(0, 3))


def row(own_arm: str, arm: str, success: bool, let_through: bool = True) -> dict[str, Any]:
    return {
        "own_arm": own_arm, "arm": arm, "pair": f"{own_arm}>{arm}", "success": success, "let_through": let_through,
        "peak_n": 40.0, "cause": "" if success else "stuck in the bore",
    }  # fmt: skip


def test_a_pair_passes_by_what_was_let_through_and_counts_only_if_anything_was():
    good, bad = row("jaco", "panda", True), row("panda", "jaco", False)
    refused = row("jaco", "jaco", False, let_through=False)
    summary, text = cross_arms.summarise([good] * 19 + [bad] + [row("jaco", "panda", False, False), refused])
    assert (summary["pairs"], summary["pairs_that_pass"]) == (2, 1)
    assert summary["jaco>panda"]["let_through"] == summary["jaco>panda"]["successes"] == 19
    assert summary["jaco>jaco"]["let_through"] == 0 and summary["panda>jaco"]["causes"] == [
        "stuck in the bore"
    ]
    assert "19 of 19" in text and "0 of 1 " in text and "- panda>jaco: stuck in the bore" in text
    assert "none of 1 let through" in text


def test_the_paper_s_own_set_up_is_one_of_them():
    (case, *_) = chosen(cross_arms.cases(1, 7), "baxter-left>baxter-right")
    result = cross_arms.trial(case)
    assert result["let_through"] and result["success"] and result["peak_n"] < 100.0
