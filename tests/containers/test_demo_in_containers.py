"""The whole job by script in containers: docker/compose.script.yaml over docker/compose.yaml."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from farhand.common.address import free_port
from tests.containers.engine import BUILD_S, RUN_S, STALLED, Engine

pytestmark = [pytest.mark.containers, pytest.mark.soak, pytest.mark.timeout(BUILD_S + 2 * RUN_S + 120)]

FILES = ("compose.yaml", "compose.script.yaml")


@pytest.mark.parametrize(("task", "outage"), [("hot-stab", "blackhole:10"), ("planar", "none")])
def test_the_job_is_done_by_script(engine: Engine, task: str, outage: str) -> None:
    engine = replace(engine, project="farhand-script")
    engine.compose("down", "--volumes", "--timeout", "5", timeout_s=120)
    variables = {"FARHAND_TASK": task, "FARHAND_OUTAGE": outage, "FARHAND_PAGE_PORT": str(free_port())}
    command = ("up", "--no-build", "--exit-code-from", "operator", "operator")
    up = engine.compose(*command, files=FILES, timeout_s=RUN_S, **variables)
    if up.returncode != 0 and STALLED in engine.all_words(FILES):
        up = engine.compose(*command, files=FILES, timeout_s=RUN_S, **variables)
    assert up.returncode == 0, up.stdout[-5000:] + up.stderr[-3000:]
    result = json.loads(engine.output_of("operator").strip().splitlines()[-1])
    engine.compose("down", "--volumes", "--timeout", "5", timeout_s=120)
    assert result["success"] is True
    assert result["task"] == task
    assert len(result["model_sha256"]) == 64
    assert result["link"]["profile"] == "geo"
    # Twice the one-way delay less its jitter: no command took a shorter way than the relay.
    assert result["link"]["command_round_trip_s"] >= 0.56
