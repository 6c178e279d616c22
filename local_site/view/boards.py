"""The two boards side by side, as in the paper's Fig. 2: local on the left, remote on the right."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import viser

from common.task import Task
from local_site.view import palette, shapes
from local_site.view.camera import board_origin_m
from local_site.view.palette import Rgb

OnDrag = Callable[[int, str, tuple[float, float]], None]
"""Tab, phase (start, update, end) and where the pointer is on the board [m]."""

_LINES = 10
GRID_Z_M, MODEL_Z_M, LINE_Z_M, TARGET_Z_M, MARK_Z_M = 0.001, 0.002, 0.004, 0.005, 0.007
"""What lies over what [m]."""


class Board:
    """One board; what is drawn below its `name` is in the board's own coordinates.

    Args:
        scene: Of the server.
        task: Its workspace is the board.
        remote: Whether it is the robot's.
    """

    def __init__(self, scene: viser.SceneApi, task: Task, remote: bool):
        self.size_m = (task.workspace_m[0], task.workspace_m[1])
        self.name = "/remote" if remote else "/local"
        self._origin = board_origin_m(remote, self.size_m[0])
        x, y = self._origin
        scene.add_frame(self.name, show_axes=False, position=(x, y, 0.0))
        colour = palette.REMOTE_BOARD if remote else palette.LOCAL_BOARD
        self.surface = add_flat(
            scene, f"{self.name}/board", shapes.rectangle(0, 0, *self.size_m), colour, z_m=0.0
        )
        grid, edge = (palette.REMOTE_GRID, palette.REMOTE) if remote else (palette.LOCAL_GRID, palette.LOCAL)
        add_lines(scene, f"{self.name}/grid", _grid(*self.size_m), grid, 1.0)
        add_lines(scene, f"{self.name}/edge", _edge(*self.size_m), edge, 2.0)

    def listen(self, node: Any, on_drag: OnDrag) -> None:
        """Hear drags that begin on a node of this board."""

        async def hear(event: viser.SceneNodeDragEvent[Any]) -> None:
            on_drag(event.client_id, event.phase, self._under(event))

        node.on_drag("left")(hear)

    def _under(self, event: viser.SceneNodeDragEvent[Any]) -> tuple[float, float]:
        """Where the pointer's ray meets the board, whatever the camera; kept on the board [m]."""
        eye, towards = np.array(event.client.camera.position), np.array(event.end_position)
        ray = towards - eye
        at = towards if abs(ray[2]) < 1e-9 else eye - ray * (eye[2] / ray[2])
        on_board = np.clip(at[:2] - self._origin, 0.0, self.size_m)
        if not np.isfinite(on_board).all():
            return (0.0, 0.0)
        return float(on_board[0]), float(on_board[1])


def add_backdrop(scene: viser.SceneApi, board_m: tuple[float, float]) -> None:
    """What lies below the boards; it takes drags beside them, which would turn the camera."""
    width, height = 20.0 * board_m[0], 20.0 * board_m[1]
    mesh = shapes.rectangle(-0.5 * width, -0.5 * height, width, height)
    node = add_flat(scene, "/backdrop", mesh, palette.BACKDROP, z_m=-0.01)

    async def ignore(_event: object) -> None:
        """A drag beside the boards means nothing."""

    node.on_drag("left")(ignore)


def add_flat(
    scene: viser.SceneApi, name: str, mesh: shapes.Mesh, colour: Rgb, z_m: float, **more: Any
) -> viser.MeshHandle:
    """A flat mesh without shadows."""
    return scene.add_mesh_simple(
        name, *mesh, color=colour, flat_shading=True, side="double", cast_shadow=False,
        receive_shadow=False, position=(0.0, 0.0, z_m), **more,
    )  # fmt: skip


def add_lines(
    scene: viser.SceneApi, name: str, points: np.ndarray, colour: Rgb | np.ndarray, width_px: float
) -> viser.LineSegmentsHandle:
    """Lines of a fixed thickness on the screen; the same name again replaces them.

    Args:
        scene: Of the server.
        name: Of the node.
        points: Shape (N, 2, 3) [m].
        colour: One, or one per end of each line, shape (N, 2, 3).
        width_px: Thickness.
    """
    return scene.add_line_segments(
        name, points.astype(np.float32), colour, thickness=width_px, thickness_units="screen"
    )  # fmt: skip


def _grid(width: float, height: float) -> np.ndarray:
    part = np.linspace(0.0, 1.0, _LINES + 1)[1:-1]
    z = GRID_Z_M
    upright = [[[x, 0.0, z], [x, height, z]] for x in part * width]
    level = [[[0.0, y, z], [width, y, z]] for y in part * height]
    return np.array(upright + level)


def _edge(width: float, height: float) -> np.ndarray:
    corners = np.array([[0, 0], [width, 0], [width, height], [0, height], [0, 0]], float)
    return shapes.segments(corners, GRID_Z_M)
