"""A hidden demonstration is not drawn any more and is called hidden in the table, but stays learned."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import viser

from farhand.common.model.task_frame import TaskFrame
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.view.page_access import PageAccess
from farhand.local_site.view.scene.arm.task_drawing import Demonstrations
from farhand.local_site.view.scene.board.planar_scene import PlanarScene
from farhand.local_site.view.scene.ghost import RobotPicture
from farhand.local_site.view.scene.nodes import Layers
from farhand.local_site.view.server import PageServer
from farhand.local_site.view.sessions import Sessions
from tests.browser.desk_page import page_of
from tests.browser.raw_client import RawClient, raw_connection
from tests.local_site.robot_end import TASK

PATIENCE_S = 60.0


@pytest.fixture
def server() -> Iterator[PageServer]:
    server = PageServer(PageAccess(), 0, Sessions(), lambda _tab: None)
    yield server
    server.stop()


def points(server: PageServer, end: str) -> np.ndarray:
    """Ends of all drawn lines of the node whose name ends so. Shape (N, 3)."""
    nodes = server.scene._handle_from_node_name
    (node,) = [node for name, node in nodes.items() if name.endswith(end)]
    assert isinstance(node, viser.LineSegmentsHandle)
    return np.asarray(node.points).reshape(-1, 3)


def test_on_a_board_only_the_hidden_stroke_goes(server: PageServer, taught: ConsoleState) -> None:
    scene = PlanarScene(server.scene, TASK, lambda intent: None, lambda words: None, lambda tab, do: None)

    def drawn() -> np.ndarray:
        scene.draw(taught, RobotPicture(taught, 0.0))
        return points(server, "/strokes")

    whole = drawn()
    scene.layers.toggle_demonstration(taught.demonstration_names[1])
    rest = drawn()
    begins = np.array([stroke[0, :2] for stroke in taught.strokes])
    apart_m = [
        [np.linalg.norm(seen[:, :2] - begin, axis=1).min() for begin in begins] for seen in (whole, rest)
    ]
    assert (np.array(apart_m) < 1e-6).tolist() == [[True, True, True], [True, False, True]]
    scene.layers.toggle_demonstration(taught.demonstration_names[1])
    np.testing.assert_array_equal(drawn(), whole)


def test_of_an_arm_only_the_hidden_curve_goes_and_the_one_in_progress_stays(
    server: PageServer, taught: ConsoleState
) -> None:
    layers = Layers(server.scene, {})
    drawing = Demonstrations(server.scene, "/frame", layers)
    n = len(taught.demonstration_names)
    strokes = tuple(np.full((5, 7), float(number)) for number in range(n + 1))
    frames = ((TaskFrame(np.eye(3), np.zeros(3)),),) * (n + 1)
    state = replace(taught, learned=None, recording=True, strokes=strokes, stroke_frames=frames)
    for number, name in enumerate(state.demonstration_names[:-1], 1):
        layers.toggle_demonstration(name)
        drawing.draw(state)
        assert set(points(server, "/demonstrations")[:, 0]) == set(range(number, n))
        assert set(points(server, "/demonstration")[:, 0]) == {n}
    layers.toggle_demonstration(state.demonstration_names[-1])
    drawing.draw(state)
    assert "/frame/demonstrations" not in server.scene._handle_from_node_name
    assert set(points(server, "/demonstration")[:, 0]) == {n}


def test_the_page_hides_the_chosen_demonstration_calls_it_hidden_and_keeps_it_learned(tmp_path: Path) -> None:
    with page_of(tmp_path) as (it, page), raw_connection(page.address) as connection:
        client = RawClient(connection)
        client.press("Load samples")
        assert client.shows("<td>3</td>", PATIENCE_S)
        learned = it.console.picture.learned
        client.press("Hide demonstration")
        assert client.shows("<td>3, hidden</td>", PATIENCE_S)
        client.press("Hide demonstration")  # the same button, which says Show demonstration now
        assert client.shows("<td>3</td>", PATIENCE_S)
        assert it.console.picture.learned is learned and it.console.picture.n_demonstrations == 3
