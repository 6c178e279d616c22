"""Robot's side as last reported: its point, its task frame with the model and the path, its ghost.

Learned components as ellipses of two standard deviations, below a frame that carries them along.
"""

from __future__ import annotations

import math

import numpy as np
import viser
from numpy.typing import NDArray

from farhand.common.model.tphsmm import TPHSMM
from farhand.common.wire.messages import Telemetry
from farhand.local_site.view.panels.words.controls import ROBOT_NAME, Layer, high
from farhand.local_site.view.scene import palette, shapes
from farhand.local_site.view.scene.board.boards import Board
from farhand.local_site.view.scene.curves import Trace
from farhand.local_site.view.scene.ghost import RobotPicture, shown_points, unmoved
from farhand.local_site.view.scene.landmarks import Landmarks, reported_places
from farhand.local_site.view.scene.nodes import (
    HIDDEN_Z_M,
    LINE_Z_M,
    MARK_Z_M,
    MAT_Z_M,
    MODEL_Z_M,
    TARGET_Z_M,
    Layers,
    add_flat,
    add_lines,
    place,
    show,
)
from farhand.local_site.view.scene.tube import Tube

_DEVIATIONS = 2.0
_OPACITY = 0.35
_ABOVE_M, _LAYERS = 1e-4, 20
"""Difference in height between two components, so that overlapping ones are drawn properly [m]."""


class ModelDrawing:
    """Components of one model in the coordinates of a node: its last task frame.

    Args:
        scene: Scene of the server.
        parent: Name of the node that is the task frame.
    """

    def __init__(self, scene: viser.SceneApi, parent: str):
        self._scene, self._name = scene, f"{parent}/model"
        self._model: TPHSMM | None = None
        self._active = -1
        self._drawn: tuple[viser.BatchedMeshHandle, viser.LineSegmentsHandle] | None = None
        self._rims = np.zeros((0, 0, 2, 3))
        self._marked: viser.LineSegmentsHandle | None = None

    def show(self, model: TPHSMM | None, active: int = -1) -> None:
        """Show a model, or none, with the component in execution, or -1."""
        if model is self._model and active == self._active:
            return
        if model is None:
            self._remove()
            self._rims = self._rims[:0]
        elif model is not self._model:
            self._redraw(model)
        self._model, self._active = model, active
        self._mark(active)

    def _redraw(self, model: TPHSMM) -> None:
        """Change the drawing in place while the number of components stays: a new node would flicker."""
        values, vectors = np.linalg.eigh(model.covariances[-1, :, :2, :2])
        radii = _DEVIATIONS * np.sqrt(values)
        heights = MODEL_Z_M + _ABOVE_M * (np.arange(model.n_components) % _LAYERS)
        positions = np.column_stack([model.means[-1, :, :2], heights]).astype(np.float32)
        colours = palette.many([palette.component_colour(float(p)) for p in model.phase])
        angles = 0.5 * np.arctan2(vectors[:, 1, 1], vectors[:, 0, 1])  # half the length of the longer axis
        turns = np.column_stack([np.cos(angles), *np.zeros((2, angles.size)), np.sin(angles)])
        scales = np.column_stack([radii[:, 1], radii[:, 0], np.ones(angles.size)])
        rims = (shapes.circle() * radii[:, None, :]) @ np.swapaxes(vectors, 1, 2)
        points = np.dstack([rims, np.zeros(rims.shape[:2])]) + positions[:, None, :]
        self._rims = np.stack([points[:, :-1], points[:, 1:]], axis=2)
        lines = self._rims.reshape(-1, 2, 3).astype(np.float32)
        each = np.broadcast_to(colours[:, None, None, :], self._rims.shape).reshape(-1, 2, 3)
        if self._drawn is not None and len(self._drawn[0].batched_positions) == model.n_components:
            areas, outlines = self._drawn
            areas.batched_positions, areas.batched_wxyzs = positions, turns.astype(np.float32)
            areas.batched_scales, areas.batched_colors = scales.astype(np.float32), colours
            outlines.points, outlines.colors = lines, each
            return
        self._remove()
        areas = self._scene.add_batched_meshes_simple(
            f"{self._name}/areas", *shapes.disc(), turns, positions, batched_scales=scales, batched_colors=colours,
            opacity=_OPACITY, lod="off", flat_shading=True, side="double", cast_shadow=False, receive_shadow=False,
        )  # fmt: skip
        self._drawn = areas, add_lines(self._scene, f"{self._name}/outlines", lines, each, 1.5)

    def _remove(self) -> None:
        for node in self._drawn or ():
            node.remove()
        self._drawn = None

    def _mark(self, active: int) -> None:
        """Draw a white rim around the component in execution."""
        if self._marked is not None:
            self._marked.remove()
            self._marked = None
        if 0 <= active < len(self._rims):
            lines = self._rims[active] + [0.0, 0.0, _ABOVE_M]
            self._marked = add_lines(self._scene, f"{self._name}/active", lines, palette.ACTIVE, 4.0)


_POINT_RADIUS_M = 0.018


class RobotDrawing:
    """Drawing of the remote board's contents. Used by the page's thread.

    Args:
        scene: Scene of the server.
        board: Remote board.
        layers: What the operator hides and shows.
        in_space: True for a task in space, of which the board is the ground.
    """

    def __init__(self, scene: viser.SceneApi, board: Board, layers: Layers, in_space: bool = False):
        self._scene, name = scene, board.name
        self._landmarks = Landmarks(scene, name, in_space)
        self._frame = scene.add_frame(f"{name}/target", show_axes=False, visible=False)
        self._frame_name = f"{name}/target"
        self._target = add_target(scene, self._frame_name)
        w, h = shapes.U_WIDTH_M, shapes.U_HEIGHT_M
        around = shapes.rectangle(-0.5 * w, -0.5 * h, w, h)
        self.grip = add_flat(scene, f"{self._frame_name}/grip", around, palette.TARGET, HIDDEN_Z_M + 0.01)
        self._model = ModelDrawing(scene, layers.node(Layer.MODEL, f"{self._frame_name}/learned"))
        self._predicted = layers.node(Layer.PATH, f"{self._frame_name}/predicted")
        self._tube = Tube(scene, self._predicted, MODEL_Z_M)
        self._trace = Trace(scene, layers.node(Layer.TRACE, f"{self._frame_name}/trace"), LINE_Z_M)
        self._name = scene.add_label(
            f"{name}/name",
            ROBOT_NAME,
            position=(0.5 * board.size_m[0], board.size_m[1], MAT_Z_M),
            anchor="top-center",
        )
        disc, ring = shapes.disc(_POINT_RADIUS_M), shapes.ring(1.25 * _POINT_RADIUS_M, 0.95 * _POINT_RADIUS_M)
        self._point = add_flat(scene, f"{name}/robot", disc, palette.REMOTE, MARK_Z_M, visible=False)
        self._ghost = add_flat(
            scene, f"{self._predicted}/ghost", disc, palette.PREDICTED, MARK_Z_M, opacity=0.6, visible=False
        )
        self._hollow = add_flat(
            scene, f"{self._predicted}/hollow", ring, palette.PREDICTED, MARK_Z_M, visible=False
        )
        self._path: NDArray[np.float64] | None = None
        self._line: viser.LineSegmentsHandle | None = None
        self._misses = False
        self._old = False

    def draw(self, picture: RobotPicture) -> None:
        """Show a report of the robot and the prediction."""
        state = picture.state
        robot = state.robot
        if robot is None:
            return
        self._draw_report(robot, picture.old)
        self._landmarks.draw(state.task.frame_names, reported_places(robot))
        self._trace.show(None if picture.trace is None else picture.trace[:, :2])
        name = high(picture.name(ROBOT_NAME), robot.position_m[2:])
        if self._name.text != name:
            self._name.text = name
        has = state.robot_model
        self._model.show(has.model if has is not None else None, robot.component)
        points = None if state.phase.at_end else shown_points(state)
        self._draw_path(points, bool(picture.miss))
        self._tube.show(
            points if points is None else points[:, :2], has.model if has is not None else None, state.plan_id
        )
        self._draw_ghost(picture)

    def _draw_report(self, robot: Telemetry, old: bool) -> None:
        x, y = robot.frame_origin_m[:2]
        place(self._frame, x, y, 0.0)
        angle = robot.frame_rotation_rad[0] if len(robot.frame_rotation_rad) == 1 else 0.0
        turn = (math.cos(0.5 * angle), 0.0, 0.0, math.sin(0.5 * angle))
        if any(abs(a - b) > 1e-3 for a, b in zip(turn, self._frame.wxyz, strict=True)):
            self._frame.wxyz = turn
        place(self._point, robot.position_m[0], robot.position_m[1], MARK_Z_M)
        show(self._frame, True)
        show(self._point, True)
        if old != self._old:
            self._old = old
            self._point.color = palette.OLD if old else palette.REMOTE
            self._target.color = palette.OLD if old else palette.TARGET

    def _draw_path(self, points: NDArray[np.float64] | None, misses: bool) -> None:
        if misses == self._misses and unmoved(self._path, points):
            return
        if self._line is not None and misses != self._misses:
            self._line.remove()
            self._line = None
        self._path, self._misses = points, misses
        if points is not None and len(points) > 1:
            lines = shapes.segments(points[:, :2], LINE_Z_M)
            if self._line is not None and self._line.points.shape == lines.shape:
                self._line.points = lines.astype(np.float32)  # in place: a new node would flicker
            else:
                self._line = add_lines(
                    self._scene,
                    f"{self._predicted}/path",
                    lines,
                    palette.MISSES if misses else palette.PREDICTED,
                    3.0,
                )
        elif self._line is not None:
            self._line.remove()
            self._line = None

    def _draw_ghost(self, picture: RobotPicture) -> None:
        hand, done = picture.hand, picture.ghost is not None and picture.ghost.done
        for mark, shown in ((self._ghost, hand is not None and not done), (self._hollow, done)):
            if hand is not None and shown:
                place(mark, float(hand[0]), float(hand[1]), MARK_Z_M)
            show(mark, shown)


def add_target(scene: viser.SceneApi, frame: str) -> viser.MeshHandle:
    """Add the U below a node that is its frame."""
    return add_flat(scene, f"{frame}/u", shapes.u_shape(), palette.TARGET, TARGET_Z_M)
