"""Two rounds of the study; the whole of it is `farhand evaluate in-and-out`."""

from __future__ import annotations

from farhand.evaluation.arm import in_and_out
from farhand.evaluation.study import chosen


def test_an_arm_of_seven_joints_comes_back_to_where_it_was():
    result = in_and_out.trial(chosen(in_and_out.cases(2, 3), "panda")[0])
    assert (result["done"], result["cause"]) == (4, "")
    assert 0.0 < result["drift_in_rad"] < in_and_out.MOST_RAD
    summary, markdown = in_and_out.summarise([result])
    assert summary["panda"]["done"] == 4 and "| panda | 4 of 4 | none |" in markdown
