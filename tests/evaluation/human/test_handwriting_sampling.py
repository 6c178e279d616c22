from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest

from farhand.evaluation.human import handwriting, handwriting_sampling


@pytest.fixture(scope="module")
def c_shape() -> Path:
    return next(path for path in handwriting.lasa_files() if path.stem == "CShape")


def errors(path: Path, assignment: str, by_start: bool) -> list[float]:
    """Of every third way to sample."""
    cases = [case for case in handwriting_sampling.cases(path)
             if (case["assignment"], case["by_start"]) == (assignment, by_start)]  # fmt: skip
    return [handwriting_sampling.trial(case)["error"] for case in cases[::3]]


def test_every_sampling_is_tried_with_each_assignment_and_both_ways_to_branch(c_shape):
    cases = handwriting_sampling.cases(c_shape)
    assert len({(case["kind"], case["n"]) for case in cases}) == 21
    assert set(Counter((case["assignment"], case["by_start"]) for case in cases).values()) == {21}


def test_with_a_small_lambda_the_error_jumps_with_the_sampling_and_the_start_cures_it(c_shape):
    by_time = errors(c_shape, "small lambda", by_start=False)
    assert max(by_time) > 3.0 * min(by_time)
    by_start = errors(c_shape, "small lambda", by_start=True)
    assert max(by_start) < 1.5 * min(by_start)
    assert max(by_start) < 4.5


def test_the_default_rule_does_not_jump_and_the_start_makes_it_better(c_shape):
    by_time = errors(c_shape, "default rule", by_start=False)
    assert max(by_time) < 1.5 * min(by_time)
    by_start = errors(c_shape, "default rule", by_start=True)
    assert max(by_start) < 1.1 * min(by_start)
    assert max(by_start) < min(3.5, *by_time)


def test_the_summary_gives_the_range_of_each(c_shape):
    results = [{**case, "error": 1.0 + case["n"]} for case in handwriting_sampling.cases(c_shape)]
    summary, text = handwriting_sampling.summarise(results)
    assert summary["small lambda, time and start"] == {"least": 2.0, "median": 8.0, "largest": 1001.0}
    assert "| small lambda | time and start | 2.00 | 8.00 | 1001.00 |" in text
    assert "over 21 samplings" in text
