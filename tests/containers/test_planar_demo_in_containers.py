"""The planar demonstration through docker/compose.yaml, as a user runs it.

Uses the engine at DOCKER_HOST (or Docker's usual socket); `.ci/container-engine` starts one where there
is none.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

_REPOSITORY = Path(__file__).parents[2]
_COMPOSE_FILE = _REPOSITORY / "docker" / "compose.yaml"
_PROJECT = "farhand-test"
# Generous time-outs: what they end has failed.
_ANSWER_S, _BUILD_S, _RUN_S = 15, 900, 300

pytestmark = [pytest.mark.containers, pytest.mark.timeout(_BUILD_S + _RUN_S + 120)]


@dataclass(frozen=True)
class Engine:
    """A container engine that answers.

    Args:
        docker: Path of the client.
        compose: The command line of Compose, version 1 or 2.
        environment: Environment variables of every command.
    """

    docker: str
    compose: tuple[str, ...]
    environment: dict[str, str]

    def run(self, *command: str, timeout_s: float, **variables: str) -> subprocess.CompletedProcess[str]:
        """Run a command against this engine and return what it wrote, both streams apart."""
        return subprocess.run(
            command,
            env=self.environment | variables,
            cwd=_REPOSITORY,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=timeout_s,
            check=False,
        )

    def compose_run(
        self, *arguments: str, timeout_s: float, **variables: str
    ) -> subprocess.CompletedProcess[str]:
        """Run Compose on the project of this test."""
        project = ("--project-name", _PROJECT, "--file", str(_COMPOSE_FILE))
        return self.run(*self.compose, *project, *arguments, timeout_s=timeout_s, **variables)

    def output_of(self, service: str) -> str:
        """What a service's container wrote to its standard output."""
        container = self.compose_run("ps", "--quiet", service, timeout_s=_ANSWER_S).stdout.strip()
        return self.run(self.docker, "logs", container, timeout_s=_ANSWER_S).stdout


def _succeeds(environment: dict[str, str], *command: str) -> bool:
    try:
        done = subprocess.run(command, env=environment, capture_output=True, timeout=_ANSWER_S, check=False)
    except (FileNotFoundError, subprocess.TimeoutExpired):
        return False
    return done.returncode == 0


def _find_engine() -> Engine:
    """The first client that reaches an engine and has Compose beside it; skips if there is none."""
    # The distribution's client first: it fits the distribution's Compose.
    for docker in ("/usr/bin/docker", shutil.which("docker")):
        if docker is None or not Path(docker).exists():
            continue
        # Compose 1 builds with the client it finds first, which must be the one that was tried.
        environment = os.environ | {
            "PATH": f"{Path(docker).parent}:{os.environ['PATH']}",
            "DOCKER_BUILDKIT": "1",
            "COMPOSE_DOCKER_CLI_BUILD": "1",
        }
        if not _succeeds(environment, docker, "version"):
            continue
        for compose in ((docker, "compose"), ("docker-compose",)):
            if _succeeds(environment, *compose, "version"):
                return Engine(docker, compose, environment)
    pytest.skip(
        "no container engine with Compose answers: start one (.ci/container-engine start) and set DOCKER_HOST"
    )


@pytest.fixture(scope="module")
def engine() -> Iterator[Engine]:
    """An engine on which the three images are built from this work tree."""
    engine = _find_engine()
    built = engine.compose_run("build", timeout_s=_BUILD_S)
    assert built.returncode == 0, built.stdout[-3000:] + built.stderr[-3000:]
    yield engine
    engine.compose_run("down", "--volumes", "--timeout", "5", timeout_s=120)


def test_the_sites_meet_through_the_link_alone_and_the_task_succeeds(engine: Engine) -> None:
    up = engine.compose_run(
        *("up", "--no-build", "--exit-code-from", "local"),
        timeout_s=_RUN_S,
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
