"""The paper's job in three processes over a satellite: two arms, contact, a model of poses."""

from __future__ import annotations

from typing import Any

import pytest

from tests.integration.conftest import Demo


@pytest.fixture(scope="module")
def result(hot_stab: Demo) -> dict[str, Any]:
    return hot_stab.result()


def test_the_plug_is_seated(result: dict[str, Any]):
    assert result["task"] == "hot-stab" and result["success"] is True
    execution = result["execution"]
    assert 0.075 <= execution["depth_m"] <= 0.095 and execution["lateral_m"] < 0.004
    assert execution["end_error_m"] < 0.010
    assert 0.0 < execution["holding_force_n"] <= execution["peak_force_n"] < 400.0


def test_five_demonstrations_on_the_operators_arm_become_a_model_of_a_few_kilobytes(result: dict[str, Any]):
    assert result["n_demonstrations"] == 5 and result["model_acknowledged"] is True
    assert 6 <= result["n_components"] <= 20 and result["model_bytes"] < 9_000


def test_it_was_driven_previewed_and_executed_in_this_order(result: dict[str, Any]):
    texts = [event["text"] for event in result["events"]]
    steps = [
        "demonstration 5 of 5",
        "confirmed by the robot",
        "couple:",
        "drove",
        "previewed",
        "execute:",
        "seated",
        "disarm:",
    ]
    at = [next(i for i, text in enumerate(texts) if step in text) for step in steps]
    assert at == sorted(at)
