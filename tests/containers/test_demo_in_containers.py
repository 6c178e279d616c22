"""The whole job through docker/compose.yaml, as a user runs it."""

from __future__ import annotations

import json
from typing import Any

import pytest

from tests.containers.engine import BUILD_S, RUN_S, STALLED, Engine

pytestmark = [pytest.mark.containers, pytest.mark.timeout(BUILD_S + 2 * RUN_S + 120)]


def done_in_containers(engine: Engine, **variables: str) -> dict[str, Any]:
    """The result of a job that succeeded."""
    variables |= {"FARHAND_LINK_PROFILE": "geo", "FARHAND_OUTAGE": "none"}
    command = ("up", "--no-build", "--exit-code-from", "local")
    up = engine.compose_run(*command, timeout_s=RUN_S, **variables)
    if up.returncode != 0 and STALLED in up.stdout:
        up = engine.compose_run(*command, timeout_s=RUN_S, **variables)
    assert up.returncode == 0, up.stdout[-5000:] + up.stderr[-3000:]
    result = json.loads(engine.output_of("local").strip().splitlines()[-1])
    assert result["success"] is True
    assert len(result["model_sha256"]) == 64
    assert result["link"]["profile"] == "geo"
    # Twice the one-way delay less its jitter: no command took a shorter way than the relay.
    assert result["link"]["command_round_trip_s"] >= 0.56
    return result


def test_the_sites_meet_through_the_link_alone_and_the_plug_is_seated(engine: Engine) -> None:
    result = done_in_containers(engine)
    assert result["task"] == "hot-stab"
    assert result["n_demonstrations"] == 5
    assert 8 <= result["n_components"] <= 20
    assert 0.075 <= result["execution"]["depth_m"] <= 0.095


@pytest.mark.soak
def test_the_board_s_task_is_done_in_containers_too(engine: Engine) -> None:
    result = done_in_containers(engine, FARHAND_TASK="planar")
    assert result["task"] == "planar"
    assert result["n_demonstrations"] == result["n_paths"] == 3
    assert 4 <= result["n_components"] <= 9
