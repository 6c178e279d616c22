"""docker/robot.yaml and docker/operator.yaml as on two machines: each on a network of its own, a route between them.

The robot is found at the address where its port is published; the engine lets no packet from one network into the
other, so that this is the only way.
"""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from playwright.sync_api import Browser

from farhand.deploy.pki.registry import Registry
from farhand.deploy.status import DEGRADED
from tests.browser.arm_page import ArmPage
from tests.containers.engine import ANSWER_S, BUILD_S, RUN_S, Engine
from tests.containers.place import Place

pytestmark = [pytest.mark.containers, pytest.mark.soak, pytest.mark.timeout(BUILD_S + 2 * RUN_S)]


@pytest.fixture
def machines(engine: Engine, tmp_path: Path) -> Iterator[tuple[Place, Place]]:
    """The robot's and the operator's."""
    usual = json.loads(engine.do("network", "inspect", "bridge"))[0]
    address = usual["IPAM"]["Config"][0].get("Gateway", "172.17.0.1")
    registry = Registry.create(tmp_path / "pki", "fleet")
    folders = registry.issue("rov1", "robot", (address,), 30), registry.issue("shore-1", "operator", (), 30)
    shutil.copy(tmp_path / "pki" / "sites.json", folders[0])
    readable_in_containers(tmp_path)
    robot = Place(
        replace(engine, project="farhand-robot"), ("robot.yaml",),
        {"FARHAND_LISTEN": address, "FARHAND_CERTIFICATES": str(folders[0])},
    )  # fmt: skip
    operator = Place(
        replace(engine, project="farhand-operator"), ("operator.yaml",),
        {"FARHAND_ROBOT": address, "FARHAND_CERTIFICATES": str(folders[1])},
    )  # fmt: skip
    yield robot, operator
    for place in (operator, robot):
        place.compose("down", "--volumes", "--timeout", "5")


def readable_in_containers(folder: Path) -> None:
    """Let the containers' user, who is another one, read the certificates."""
    for each in (folder, *folder.rglob("*")):
        each.chmod(0o755 if each.is_dir() else 0o644)


def test_the_operator_waits_for_the_robot_and_seats_the_plug(
    machines: tuple[Place, Place], browser: Browser
) -> None:
    robot, operator = machines
    operator.up()  # first: the order does not matter
    operator.await_troubles("operator", {"page-only"})
    assert operator.status("operator", "--of=operator")[0] == DEGRADED
    robot.compose("up", "--no-build", "--detach")
    operator.await_troubles("operator", set())
    waited = operator.engine.container("operator")
    assert operator.engine.do("inspect", "--format={{.RestartCount}}", waited) == "0"
    own, other = (
        next(iter(robot.networks("robot").values())),
        next(iter(operator.networks("operator").values())),
    )
    assert own.rpartition(".")[0] != other.rpartition(".")[0]
    direct = f"import socket; socket.create_connection(('{own}', 7447), 2)"
    command = (operator.engine.docker, "exec", operator.engine.container("operator"), "python3", "-c", direct)
    assert operator.engine.run(*command, timeout_s=ANSWER_S).returncode != 0
    tab = ArmPage(browser.new_context(viewport={"width": 1000, "height": 620}).new_page())
    tab.open(operator.address)
    tab.execute_until_seated("Load samples")
    tab.says("link", re.compile("OK"))
    tab.page.context.close()
