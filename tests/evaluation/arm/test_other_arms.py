"""Other arms than the one that comes first: the studies' own trials on two of them."""

from __future__ import annotations

import pytest

from farhand.evaluation.arm import hot_stab
from farhand.evaluation.study import chosen

N_TRIALS = 10


@pytest.mark.parametrize("arm", ["baxter-right", "ur5e"])
def test_what_was_taught_on_one_arm_is_inserted_by_another_with_seven_joints_and_with_six(arm: str):
    cases = chosen(hot_stab.cases(N_TRIALS, 0), "typical")
    results = [hot_stab.trial({**case, "arm": arm}) for case in cases]
    assert len(results) == N_TRIALS
    assert all(result["success"] for result in results), [result["cause"] for result in results]
    assert max(result["peak_n"] for result in results) < 100.0
