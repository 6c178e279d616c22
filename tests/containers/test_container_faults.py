"""Each container paused, killed and disconnected while the robot inserts its plug.

What befalls the link or the operator does not stop the robot; after its own container's fault the job can be done anew.
"""

from __future__ import annotations

import json

import pytest

from farhand.local_site.script.operators_place import RealTime
from tests.containers.engine import BUILD_S, RUN_S, STALLED, Engine

pytestmark = [pytest.mark.containers, pytest.mark.soak, pytest.mark.timeout(BUILD_S + 3 * RUN_S)]

_FAULT_S = 5.0
_EXECUTING = "the robot is in AUTONOMOUS"
# The network over which a container speaks with the others' side.
_NETWORK = {"remote": "subsea", "link": "subsea", "local": "shore"}


def pause(engine: Engine, service: str) -> None:
    container = engine.container(service)
    engine.do("pause", container)
    RealTime().pause(_FAULT_S)
    engine.do("unpause", container)


def kill(engine: Engine, service: str) -> None:
    container = engine.container(service)
    engine.do("kill", container)
    RealTime().pause(_FAULT_S)
    engine.do("start", container)


def disconnect(engine: Engine, service: str) -> None:
    container, network = engine.container(service), f"{engine.project}_{_NETWORK[service]}"
    engine.do("network", "disconnect", network, container)
    RealTime().pause(_FAULT_S)
    engine.do("network", "connect", "--alias", service, network, container)


_ALL = [(fault, service) for fault in (pause, kill, disconnect) for service in ("link", "remote", "local")]


@pytest.mark.parametrize(
    ("fault", "service"),
    _ALL,
    ids=[f"{fault.__name__} {service}" for fault, service in _ALL],
)
def test_after_a_fault_of_a_container_the_job_can_be_done(engine: Engine, fault, service: str) -> None:
    engine.compose_run("down", "--timeout", "5", timeout_s=120)
    up = engine.compose_run("up", "--no-build", "--detach", timeout_s=RUN_S, FARHAND_LINK_PROFILE="geo")
    assert up.returncode == 0, up.stderr
    engine.await_words("local", _EXECUTING, RUN_S)
    fault(engine, service)
    local = engine.container("local")
    status, words = engine.do("wait", local, timeout_s=RUN_S), engine.words_of("local")
    if (fault, service) == (kill, "remote") or STALLED in words:
        # The robot was restarted and is disarmed, or it has stopped: the operator begins anew.
        assert status == "1"
        engine.do("start", local)
        status, words = engine.do("wait", local, timeout_s=RUN_S), engine.words_of("local")
    assert status == "0", words[-5000:]
    assert json.loads(engine.output_of("local").strip().splitlines()[-1])["success"] is True
