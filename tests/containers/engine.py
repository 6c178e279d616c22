"""A container engine, as a user has one: its client, and Compose beside it.

The engine at DOCKER_HOST is used (or at Docker's usual socket); `.ci/container-engine` starts one where there
is none.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import threading
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import pytest

_REPOSITORY = Path(__file__).parents[2]
_FOLDER = _REPOSITORY / "docker"
_FILES = ("compose.yaml",)
# Generous time-outs: what they end has failed.
ANSWER_S, BUILD_S, RUN_S = 15, 900, 300
STALLED = "the control loop was"
"""Said of a robot that has stopped since its control loop stood still: its container was paused, or the machine busy."""


@dataclass(frozen=True)
class Engine:
    """A container engine that answers.

    Args:
        docker: Path of the client.
        client: The command line of Compose, version 1 or 2.
        environment: Environment variables of every command.
        project: What Compose calls all that belongs together.
    """

    docker: str
    client: tuple[str, ...]
    environment: dict[str, str]
    project: str = "farhand-test"

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

    def compose(
        self, *arguments: str, timeout_s: float, files: Sequence[str] = _FILES, **variables: str
    ) -> subprocess.CompletedProcess[str]:
        """Run Compose on the project of this test."""
        chosen = (word for name in files for word in ("--file", str(_FOLDER / name)))
        project = ("--project-name", self.project, *chosen)
        return self.run(*self.client, *project, *arguments, timeout_s=timeout_s, **variables)

    def container(self, service: str) -> str:
        """Id of a service's container, whether it runs or has ended."""
        labels = {"project": self.project, "service": service, "oneoff": "False"}
        chosen = (f"--filter=label=com.docker.compose.{name}={value}" for name, value in labels.items())
        listed = self.do("ps", "--all", "--quiet", "--no-trunc", *chosen)
        assert listed, f"there is no container of {service}"
        return listed.splitlines()[0]

    def output_of(self, service: str) -> str:
        """What a service's container wrote to its standard output."""
        return self.run(self.docker, "logs", self.container(service), timeout_s=ANSWER_S).stdout

    def words_of(self, service: str) -> str:
        """What a service's container logged."""
        return self.run(self.docker, "logs", self.container(service), timeout_s=ANSWER_S).stderr

    def all_words(self, files: Sequence[str] = _FILES) -> str:
        """The last lines that all services have logged."""
        return self.compose("logs", "--tail=40", files=files, timeout_s=ANSWER_S).stdout

    def do(self, *command: str, timeout_s: float = ANSWER_S) -> str:
        """A command of the client; what it wrote. It must succeed."""
        done = self.run(self.docker, *command, timeout_s=timeout_s)
        assert done.returncode == 0, f"docker {' '.join(command)}: {done.stderr}"
        return done.stdout.strip()

    def await_words(self, service: str, words: str, timeout_s: float) -> None:
        """Wait until a service has said something."""
        follow = [self.docker, "logs", "--follow", self.container(service)]
        with subprocess.Popen(
            follow, env=self.environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        ) as logs:
            watchdog = threading.Timer(timeout_s, logs.kill)
            watchdog.start()
            assert logs.stdout is not None
            said = ""
            for line in logs.stdout:
                said += line
                if words in line:
                    break
            watchdog.cancel()
            logs.kill()
        assert words in said, f"{service} did not say {words!r}:\n{said[-3000:]}"


def _succeeds(environment: dict[str, str], *command: str) -> bool:
    try:
        done = subprocess.run(command, env=environment, capture_output=True, timeout=ANSWER_S, check=False)
    except (FileNotFoundError, subprocess.TimeoutExpired):
        return False
    return done.returncode == 0


def find_engine() -> Engine:
    """The first client that reaches an engine and has Compose beside it; skips if there is none."""
    # The distribution's client first: it fits the distribution's Compose.
    for docker in ("/usr/bin/docker", shutil.which("docker")):
        if docker is None or not Path(docker).exists():
            continue
        # Compose 1 builds with the client it finds first, which must be the one that was tried.
        environment = os.environ | {"PATH": f"{Path(docker).parent}:{os.environ['PATH']}"}
        if not _succeeds(environment, docker, "version"):
            continue
        for compose in ((docker, "compose"), ("docker-compose",)):
            if _succeeds(environment, *compose, "version"):
                return Engine(docker, compose, environment)
    pytest.skip(
        "no container engine with Compose answers: start one (.ci/container-engine start) and set DOCKER_HOST"
    )
