"""Robot's side as last reported: its point, its task frame with the model and the path, its ghost."""

from __future__ import annotations

import math

import viser

from farhand.common.control_mode import Phase
from farhand.common.link.link_monitor import LinkHealth
from farhand.common.wire.messages import PlannedPath, Telemetry
from farhand.common.wire.path_points import points_of
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.view.scene import palette, shapes
from farhand.local_site.view.scene.board.boards import Board
from farhand.local_site.view.scene.board.model_drawing import ModelDrawing
from farhand.local_site.view.scene.ghost import Ghost, predict, shown_path
from farhand.local_site.view.scene.nodes import (
    HIDDEN_Z_M,
    LINE_Z_M,
    MARK_Z_M,
    TARGET_Z_M,
    add_flat,
    add_lines,
    place,
    show,
)

_POINT_RADIUS_M = 0.018


class RobotDrawing:
    """Drawing of the remote board's contents. Used by the page's thread.

    Args:
        scene: Scene of the server.
        board: Remote board.
    """

    def __init__(self, scene: viser.SceneApi, board: Board):
        self._scene, name = scene, board.name
        self._frame = scene.add_frame(f"{name}/target", show_axes=False, visible=False)
        self._frame_name = f"{name}/target"
        self._target = add_target(scene, self._frame_name)
        w, h = shapes.U_WIDTH_M, shapes.U_HEIGHT_M
        around = shapes.rectangle(-0.5 * w, -0.5 * h, w, h)
        self.grip = add_flat(scene, f"{self._frame_name}/grip", around, palette.TARGET, HIDDEN_Z_M + 0.01)
        self._model = ModelDrawing(scene, self._frame_name)
        disc, ring = shapes.disc(_POINT_RADIUS_M), shapes.ring(1.25 * _POINT_RADIUS_M, 0.95 * _POINT_RADIUS_M)
        self._point = add_flat(scene, f"{name}/robot", disc, palette.REMOTE, MARK_Z_M, visible=False)
        self._ghost = add_flat(
            scene, f"{self._frame_name}/ghost", disc, palette.PREDICTED, MARK_Z_M, opacity=0.6, visible=False
        )
        self._hollow = add_flat(
            scene, f"{self._frame_name}/hollow", ring, palette.PREDICTED, MARK_Z_M, visible=False
        )
        self._path: PlannedPath | None = None
        self._line: viser.LineSegmentsHandle | None = None
        self._old = False

    def draw(self, picture: ConsoleState, now_s: float) -> Ghost | None:
        """Show the newest report and the prediction; return the prediction."""
        robot = picture.robot
        if robot is None:
            return None
        self._draw_report(robot, old=picture.link.health is not LinkHealth.OK)
        has = picture.robot_model
        self._model.show(has.model if has is not None else None, robot.component)
        arrived = picture.phase is Phase.ARRIVED
        self._draw_path(None if arrived else shown_path(picture))
        ghost = None if arrived else predict(picture, now_s)
        self._draw_ghost(ghost)
        return ghost

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

    def _draw_path(self, path: PlannedPath | None) -> None:
        if path is self._path:
            return
        self._path = path
        points = points_of(path) if path is not None else None
        if points is not None and len(points) > 1:
            lines = shapes.segments(points[:, :2], LINE_Z_M)
            self._line = add_lines(self._scene, f"{self._frame_name}/path", lines, palette.PREDICTED, 3.0)
        elif self._line is not None:
            self._line.remove()
            self._line = None

    def _draw_ghost(self, ghost: Ghost | None) -> None:
        for mark, shown in (
            (self._ghost, ghost is not None and not ghost.done),
            (self._hollow, ghost is not None and ghost.done),
        ):
            if ghost is not None and shown:
                place(mark, float(ghost.point[0]), float(ghost.point[1]), MARK_Z_M)
            show(mark, shown)


def add_target(scene: viser.SceneApi, frame: str) -> viser.MeshHandle:
    """Add the U below a node that is its frame."""
    return add_flat(scene, f"{frame}/u", shapes.u_shape(), palette.TARGET, TARGET_Z_M)
