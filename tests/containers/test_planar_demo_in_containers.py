"""The planar demonstration through docker/compose.yaml, as a user runs it."""

from __future__ import annotations

import json

import pytest

from tests.containers.engine import BUILD_S, RUN_S, Engine

pytestmark = [pytest.mark.containers, pytest.mark.timeout(BUILD_S + RUN_S + 120)]


def test_the_sites_meet_through_the_link_alone_and_the_task_succeeds(engine: Engine) -> None:
    up = engine.compose_run(
        *("up", "--no-build", "--exit-code-from", "local"),
        timeout_s=RUN_S,
        FARHAND_LINK_PROFILE="geo",
        FARHAND_OUTAGE="none",
    )
    assert up.returncode == 0, up.stdout[-5000:] + up.stderr[-3000:]

    result = json.loads(engine.output_of("local").strip().splitlines()[-1])
    assert result["task"] == "planar"
    assert result["success"] is True
    assert result["n_demonstrations"] == 3
    assert 4 <= result["n_components"] <= 9
    assert result["n_paths"] == 3
    assert len(result["model_sha256"]) == 64
    assert result["link"]["profile"] == "geo"
    # Twice the one-way delay less its jitter: no command took a shorter way than the relay.
    assert result["link"]["command_round_trip_s"] >= 0.56
