"""The arms' scene on a real server without a browser: the robot appears once it is known, and may change."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
import viser

from farhand.common.arm.cell import Cell, Plug
from farhand.common.arm.simulation.description import describe
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.view.page_access import PageAccess
from farhand.local_site.view.panels.status_strip import _remote_words
from farhand.local_site.view.panels.words.tasks import words_of
from farhand.local_site.view.scene.arm.arm_scene import ArmScene
from farhand.local_site.view.scene.ghost import RobotPicture
from farhand.local_site.view.server import PageServer
from farhand.local_site.view.sessions import Sessions
from tests.cells import JACO
from tests.local_site.exchange.test_robot_scene import report
from tests.local_site.robot_end import HOT_STAB
from tests.local_site.view.panels.test_truth import LOST

OWN = describe(JACO)
OTHER = describe(Cell(robot=JACO.robot, plug=Plug(radius_m=0.015)))


@pytest.fixture
def server() -> Iterator[PageServer]:
    server = PageServer(PageAccess(), 0, Sessions(), lambda _tab: None)
    yield server
    server.stop()


def instances(server: PageServer) -> dict[str, int]:
    """How many of each mesh of an arm there are, by the first part of its name."""
    nodes = server.scene._handle_from_node_name
    batches = {name: node for name, node in nodes.items() if isinstance(node, viser.BatchedMeshHandle)}
    return {name.split("/")[1]: len(node.batched_positions) for name, node in batches.items()}


def test_the_robot_is_drawn_once_it_is_known_and_drawn_anew_when_another_one_is_there(server, nothing_yet):
    scene = ArmScene(server.scene, OWN, lambda intent: None, lambda tab, do: None)
    pictures = [replace(nothing_yet, robot_scene=robot) for robot in (None, OTHER, OWN, OTHER)]
    seen = []
    for picture in pictures:
        scene.draw(picture, RobotPicture(picture, 0.0))
        seen.append(instances(server))
    assert seen == [{"arms": 1}, {"arms": 1, "robot": 1}, {"arms": 2}, {"arms": 1, "robot": 1}]
    assert any(name.startswith("/remote/receptacle") for name in server.scene._handle_from_node_name)


def test_a8_each_arm_has_its_name_in_space_beside_it_however_the_camera_turns(server, nothing_yet):
    scene = ArmScene(server.scene, OWN, lambda intent: None, lambda tab, do: None)
    late = replace(nothing_yet, robot_scene=OWN, robot=report(), now_s=20.0, link=LOST)
    scene.draw(late, RobotPicture(late, 25.0))
    nodes = server.scene._handle_from_node_name
    labels = {name: node.text for name, node in nodes.items() if isinstance(node, viser.LabelHandle)}
    assert labels == {"/local/name": "YOUR ARM (simulation)", "/remote/name": "ROBOT, 15 s ago"}
    own, robot = (np.asarray(nodes[name].position) for name in ("/local", "/remote"))
    assert np.linalg.norm(robot - own) > 1.0, "each name belongs to the node of its own arm"


def test_the_page_says_what_it_waits_for(nothing_yet: ConsoleState):
    picture = replace(nothing_yet, robot=report(), scene_fetching=0.3)
    words = _remote_words(picture, RobotPicture(picture, 0.0), "0.1 s", words_of(HOT_STAB))
    assert words == "fetching what the robot looks like, 30%"
