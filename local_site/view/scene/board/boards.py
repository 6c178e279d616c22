"""Two boards side by side, as in the paper's Fig. 2, and the camera that fits both into the page."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import viser

from farhand.common.task import PointTask
from farhand.local_site.view.panels.words.controls import ViewName
from farhand.local_site.view.scene import palette, shapes
from farhand.local_site.view.scene.nodes import ASIDE_Z_M, GRID_Z_M, HIDDEN_Z_M, MAT_Z_M, add_flat, add_lines

OnDrag = Callable[[int, str, tuple[float, float]], None]
"""Tab, phase (start, update, end), and position of the pointer on the board [m]."""

_LINES = 10
_GRIP_M = 0.02
"""Margin around a board in which it accepts drags [m]."""


class Board:
    """Board of the operator or of the robot; nodes below its `name` are in the board's own coordinates.

    Args:
        scene: Scene of the server.
        task: Task whose workspace is the board.
        remote: True for the robot's board.
    """

    def __init__(self, scene: viser.SceneApi, task: PointTask, remote: bool):
        self.size_m = (task.workspace_m[0], task.workspace_m[1])
        self.name = "/remote" if remote else "/local"
        self._origin = board_origin_m(remote, self.size_m[0])
        x, y = self._origin
        scene.add_frame(self.name, show_axes=False, position=(x, y, 0.0))
        colour = palette.REMOTE_BOARD if remote else palette.LOCAL_BOARD
        add_flat(scene, f"{self.name}/board", shapes.rectangle(0, 0, *self.size_m), colour, z_m=0.0)
        width, height = (side + 2.0 * _GRIP_M for side in self.size_m)
        grip = shapes.rectangle(-_GRIP_M, -_GRIP_M, width, height)
        self.grip = add_flat(scene, f"{self.name}/grip", grip, colour, HIDDEN_Z_M)
        grid, edge = (palette.REMOTE_GRID, palette.REMOTE) if remote else (palette.LOCAL_GRID, palette.LOCAL)
        add_lines(scene, f"{self.name}/grid", _grid(*self.size_m), grid, 1.0)
        add_lines(scene, f"{self.name}/edge", _edge(*self.size_m), edge, 2.0)

    def listen(self, node: Any, on_drag: OnDrag) -> None:
        """Handle drags that begin on a node of this board."""

        async def hear(event: viser.SceneNodeDragEvent[Any]) -> None:
            on_drag(event.client_id, event.phase, self._under(event))

        node.on_drag("left")(hear)

    def _under(self, event: viser.SceneNodeDragEvent[Any]) -> tuple[float, float]:
        """Intersect the pointer's ray with the board, whatever the camera; clipped to the board [m]."""
        eye, towards = np.array(event.client.camera.position), np.array(event.end_position)
        ray = towards - eye
        at = towards if abs(ray[2]) < 1e-9 else eye - ray * (eye[2] / ray[2])
        on_board = np.clip(at[:2] - self._origin, 0.0, self.size_m)
        if not np.isfinite(on_board).all():
            return (0.0, 0.0)
        return float(on_board[0]), float(on_board[1])


def add_mat(scene: viser.SceneApi, board_m: tuple[float, float]) -> None:
    """Add a mat with a window per board, above a plane that intercepts drags, which would else turn the camera."""
    (width, height), far = board_m, 20.0 * max(board_m)
    left, right = (board_origin_m(remote, width)[0] for remote in (False, True))
    mat = shapes.joined(
        shapes.rectangle(-far, height, 2.0 * far, far),
        shapes.rectangle(-far, -far, 2.0 * far, far),
        shapes.rectangle(-far, 0.0, far + left, height),
        shapes.rectangle(left + width, 0.0, right - left - width, height),
        shapes.rectangle(right + width, 0.0, far, height),
    )
    add_flat(scene, "/mat", mat, palette.BACKDROP, MAT_Z_M)
    aside = shapes.rectangle(-far, -far, 2.0 * far, 2.0 * far)
    node = add_flat(scene, "/aside", aside, palette.BACKDROP, ASIDE_Z_M)

    async def ignore(_event: object) -> None:
        """Ignore a drag beside the boards."""

    node.on_drag("left")(ignore)


def _grid(width: float, height: float) -> np.ndarray:
    part = np.linspace(0.0, 1.0, _LINES + 1)[1:-1]
    z = GRID_Z_M
    upright = [[[x, 0.0, z], [x, height, z]] for x in part * width]
    level = [[[0.0, y, z], [width, y, z]] for y in part * height]
    return np.array(upright + level)


def _edge(width: float, height: float) -> np.ndarray:
    corners = np.array([[0, 0], [width, 0], [width, height], [0, height], [0, 0]], float)
    return shapes.segments(corners, MAT_Z_M + 1e-3)


FOV_RAD = 0.35
"""Vertical field of view: narrow, so that nothing looks tilted [rad]."""
GAP = 0.07
"""Space between the boards, in board widths."""
MARGIN = 0.03
"""Space around both, in board widths."""
_FREE = 0.77
"""Share of the canvas's height between the views and the legend above and the cards below, which cover no board."""
VIEWS: tuple[str, ...] = (ViewName.BOTH, ViewName.MINE, ViewName.ROBOT)
"""Names of the views; the first one shows all."""


def board_origin_m(remote: bool, width_m: float) -> tuple[float, float]:
    """Return a board's lower left corner in the scene [m].

    The scene's origin is midway between the boards.
    """
    return (0.5 * GAP * width_m if remote else -(1.0 + 0.5 * GAP) * width_m, 0.0)


@dataclass(frozen=True)
class View:
    """Camera that looks straight down on the boards.

    Args:
        centre_m: Point of the scene in the middle of the canvas [m].
        pixels_per_m: Scale on the boards.
        size_px: Width and height of the canvas.
    """

    centre_m: tuple[float, float]
    pixels_per_m: float
    size_px: tuple[float, float]

    @property
    def height_m(self) -> float:
        """Height of the camera above the boards [m]."""
        return self.size_px[1] / self.pixels_per_m / (2.0 * math.tan(0.5 * FOV_RAD))

    def pixel(self, x_m: float, y_m: float) -> tuple[float, float]:
        """Project a point of the scene onto the canvas, from its upper left corner [px]."""
        return (
            0.5 * self.size_px[0] + (x_m - self.centre_m[0]) * self.pixels_per_m,
            0.5 * self.size_px[1] - (y_m - self.centre_m[1]) * self.pixels_per_m,
        )


def view_of(board_m: tuple[float, float], size_px: tuple[float, float], view: str = VIEWS[0]) -> View:
    """Return the view that fits two boards of this size, or one of them, into a canvas.

    Args:
        board_m: Width and height of a board [m].
        size_px: Width and height of the canvas.
        view: Name of the view.
    """
    (width_m, height_m), (width_px, height_px) = board_m, size_px
    across_m = ((2.0 + GAP if view == VIEWS[0] else 1.0) + 2.0 * MARGIN) * width_m
    scale = min(width_px / across_m, _FREE * height_px / (height_m + 2.0 * MARGIN * width_m))
    sides: dict[str, float] = {ViewName.MINE: -0.5, ViewName.ROBOT: 0.5}
    beside_m = sides.get(view, 0.0) * (1.0 + GAP) * width_m
    return View((beside_m, 0.5 * height_m), scale, size_px)
