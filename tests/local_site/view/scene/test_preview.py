"""Preview and prediction: a ghost that plays the path, a tube around it, an end off the goal, and the ghost's error."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from msgspec import structs

from farhand.common.mode_table import ControlMode, Phase
from farhand.common.model.task_frame import TaskFrame
from farhand.common.wire.messages import PlannedPath, Stamp, Telemetry
from farhand.common.wire.motion_encoding import packed
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.learning.online_learner import LearnerSettings, OnlineLearner
from farhand.local_site.view.page_access import PageAccess
from farhand.local_site.view.panels import buttons
from farhand.local_site.view.panels.actions import offered
from farhand.local_site.view.panels.preview_player import PreviewPlayer
from farhand.local_site.view.panels.words.advice import preview_miss_words
from farhand.local_site.view.scene.ghost import Ghost, PredictionCheck, predict, preview_miss, shown_path
from farhand.local_site.view.scene.tube import Tube, covariances_along, tube
from farhand.local_site.view.server import PageServer
from farhand.local_site.view.sessions import Sessions
from tests.local_site.robot_end import HOT_STAB
from tests.local_site.view.panels.test_plan_words import lesson
from tests.local_site.view.panels.test_truth import OK

START, END = np.array([-0.5, 0.3]), np.zeros(2)
ROBOT = Telemetry(
    seq=1, stamp=Stamp("boot", 10**9), mode=ControlMode.HOLD, position_m=(0.2, 0.6), frame_origin_m=(0.7, 0.3)
)  # fmt: skip


def path(points: np.ndarray, plan_id: int = 3, reaches_end: bool = True) -> PlannedPath:
    return PlannedPath(
        stamp=Stamp("boot", 10**9), path_id=1, plan_id=plan_id, model_sha256="a" * 64, step_s=0.1,
        reaches_end=reaches_end, n_coordinates=points.shape[1], points=packed(points),
    )  # fmt: skip


@pytest.fixture
def previewed(taught: ConsoleState) -> ConsoleState:
    """A preview of 2 s from where the robot stands to its target."""
    return replace(taught, now_s=0.0, robot=ROBOT, plan_id=3, path=path(np.linspace(START, END, 21)))


def point(player: PreviewPlayer, state: ConsoleState, now_s: float) -> np.ndarray:
    shown = player.draw(state, now_s)
    assert shown is not None
    return shown


@pytest.fixture(scope="module")
def server() -> Iterator[PageServer]:
    server = PageServer(PageAccess(), 0, Sessions(), lambda _tab: None)
    yield server
    server.stop()


def test_a_preview_is_played_once_and_then_as_its_slider_is_dragged(
    server: PageServer, previewed: ConsoleState
) -> None:
    player = PreviewPlayer(server.gui, lambda _tab, _do: None)
    assert player.draw(replace(previewed, plan_id=0), 0.0) is None and not player.plays
    at = [point(player, previewed, 100.0 + 0.5 * k) for k in range(6)]
    np.testing.assert_allclose(at[0], START, atol=1e-3)
    np.testing.assert_allclose(at[2], 0.5 * (START + END), atol=1e-3)
    np.testing.assert_allclose(at[5], END, atol=1e-3)
    assert not player.plays
    player._drag(1.5)
    np.testing.assert_allclose(point(player, previewed, 110.0), 0.25 * START, atol=1e-3)
    player._press()
    assert player.plays
    later = replace(previewed, plan_id=4, path=path(np.linspace(START, END, 21), 4))
    again = point(player, later, 120.0)
    np.testing.assert_allclose(again, START, atol=1e-3)
    assert player.draw(None, 121.0) is None and not player.plays  # the operator looks back


def test_a_preview_that_ends_off_the_tasks_goal_says_so_and_execute_is_not_first(
    previewed: ConsoleState,
) -> None:
    assert preview_miss(previewed) == "" and offered(previewed)[0] is buttons.EXECUTE
    off = replace(previewed, path=path(np.linspace(START, (0.1, 0.1), 21)))
    assert preview_miss(off) == "141 mm from the target"
    assert "ends 141 mm from the target, not at the task's goal" in preview_miss_words(off)
    assert offered(off)[0] is buttons.RECORD and buttons.EXECUTE in offered(off)
    cut = replace(previewed, path=path(np.linspace(START, END, 21), reaches_end=False))
    assert "before the end of the motion" in preview_miss_words(cut)
    long = replace(previewed, path=path(np.linspace(START, (0.5, 0.5), 200), reaches_end=False))
    assert preview_miss(long) == "" and offered(long)[0] is buttons.EXECUTE  # it is only its beginning
    beside = np.tile([0.143, 0.0, 0.044, 1.0, 0.0, 0.0, 0.0], (5, 1))
    assert "143 mm beside the bore" in preview_miss(replace(off, task=HOT_STAB, path=path(beside)))


def test_the_ghosts_error_is_told_once_the_robot_has_reported_where_it_was(
    nothing_yet: ConsoleState,
) -> None:
    speed_m_s, check = 0.1, PredictionCheck()
    planned = np.column_stack([-0.5 + speed_m_s * 0.1 * np.arange(100), np.zeros(100)])
    moving = structs.replace(ROBOT, mode=ControlMode.AUTONOMOUS, phase=Phase.APPROACHING)
    errors = []
    for tick in range(60):  # a report every 0.1 s, 0.3 s old; the robot is 7 mm beside its path
        at_s = 0.1 * tick
        then = structs.replace(
            moving,
            seq=tick + 1,
            stamp=Stamp("boot", round(1e9 * (1.0 + at_s))),
            position_m=(0.7 - 0.5 + speed_m_s * at_s, 0.3 + 0.007),
        )
        state = replace(nothing_yet, now_s=at_s, robot=then, link=OK, path=path(planned, plan_id=0))
        check.update(then, predict(state, at_s))
        errors.append(check.error_m)
    assert errors[0] is None  # nothing was expected for that time
    np.testing.assert_allclose(np.array(errors[10:], dtype=float), 0.007, atol=5e-4)
    check.update(ROBOT, None)
    assert check.error_m is None


def test_a_paused_execution_keeps_its_path(nothing_yet: ConsoleState) -> None:
    paused = structs.replace(ROBOT, mode=ControlMode.PAUSED)
    committed = path(np.linspace(START, END, 21), plan_id=0)
    assert shown_path(replace(nothing_yet, robot=paused, path=committed)) is committed


def test_the_tube_is_two_standard_deviations_wide_across_the_path() -> None:
    model = lesson((1.0, -1.0)).model
    places = model.means[-1, :, :2]
    here, exact = covariances_along(places, model), model.covariances[-1, :, :2, :2]
    nearest = np.linalg.norm(here - exact, axis=(1, 2)) / np.linalg.norm(exact, axis=(1, 2))
    assert np.median(nearest) < 0.2  # at a component it is that component's own
    line = np.column_stack([np.linspace(0.2, 0.6, 30), np.full(30, 0.1)])
    vertices, faces = tube(line, model, 0.002)
    edges = vertices.reshape(30, 2, 3)
    widths = np.linalg.norm(edges[:, 0] - edges[:, 1], axis=1)
    np.testing.assert_allclose(widths, 4.0 * np.sqrt(covariances_along(line, model)[:, 1, 1]), rtol=1e-4)
    assert faces.max() == 59 and np.allclose(vertices[:, 2], 0.002)


def test_a_tube_in_space_is_closed_and_rests_with_the_path() -> None:
    random, learner = np.random.default_rng(0), OnlineLearner(LearnerSettings(0.1), 3)
    line = np.linspace([0.0, 0.0, -0.3], [0.0, 0.0, 0.08], 150)
    for _ in range(3):
        learner.start()
        points = line + random.normal(0.0, [0.004, 0.008, 0.0], 3)
        learner.observe_many(points, [TaskFrame.identity(3)], 0.02 * np.arange(150.0))
        learner.end()
    model, path_m = learner.model(), np.vstack([line[::8], np.tile(line[-1], (5, 1))])
    vertices, faces = tube(path_m, model)
    rings = vertices.reshape(len(path_m), -1, 3) - path_m[:, None]
    radii = np.linalg.norm(rings, axis=2, keepdims=True)
    ways = rings / radii
    expected = np.einsum("nad,nde,nae->na", ways, covariances_along(path_m, model), ways)
    np.testing.assert_allclose(radii[..., 0], 2.0 * np.sqrt(expected), rtol=1e-3)
    assert np.abs(ways[:, :, 2]).max() < 1e-3  # across the path
    np.testing.assert_allclose(rings[-5:], np.broadcast_to(rings[-1], rings[-5:].shape), atol=1e-6)
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    _, shared = np.unique(edges, axis=0, return_counts=True)
    assert (shared <= 2).all() and (shared == 1).sum() == 2 * rings.shape[1]  # open at both ends alone


def test_the_tube_of_a_preview_stays_while_it_is_executed(server: PageServer) -> None:
    model = lesson((1.0,)).model
    drawn, line = Tube(server.scene, "/somewhere"), np.linspace(START, END, 21)
    names = server.scene._handle_from_node_name

    drawn.show(line, model, 3)
    node = names["/somewhere/tube"]
    drawn.show(line[10:], model, 0)
    assert names["/somewhere/tube"] is node
    drawn.show(None, model, 0)
    assert "/somewhere/tube" not in names


def test_a_ghost_beyond_its_path_rests_at_the_end(previewed: ConsoleState) -> None:
    moving = structs.replace(ROBOT, mode=ControlMode.AUTONOMOUS, phase=Phase.APPROACHING)
    ghost = predict(replace(previewed, robot=moving, path=path(np.linspace(START, END, 21), 0)), 9.0)
    assert isinstance(ghost, Ghost) and ghost.done and ghost.left_s < 0.0
    np.testing.assert_allclose(ghost.point, END, atol=1e-3)
