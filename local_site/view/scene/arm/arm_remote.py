"""Robot's side as last reported: its arm, its receptacle with the model, the path, and its ghost."""

from __future__ import annotations

import viser
from msgspec import UNSET

from farhand.common.link.link_monitor import LinkHealth
from farhand.common.wire.messages import PlannedPath, Telemetry
from farhand.common.wire.path_points import points_of
from farhand.common.wire.scene_description import SceneDescription
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.view.scene import palette
from farhand.local_site.view.scene.arm.arm_bodies import REMOTE, ArmBodies
from farhand.local_site.view.scene.arm.arm_camera import base_m
from farhand.local_site.view.scene.arm.ellipsoids import Ellipsoids
from farhand.local_site.view.scene.arm.pose_curves import Curves
from farhand.local_site.view.scene.arm.receptacle_drawing import ReceptacleDrawing, add_platform
from farhand.local_site.view.scene.ghost import Ghost, predict, reported_frame, shown_path
from farhand.local_site.view.scene.nodes import add_solids, put, show

_GHOST_OPACITY = 0.55


class RemoteArm:
    """Drawing of the robot's half. Used by the page's thread.

    Args:
        scene: Scene of the server.
        parent: Name of the node of its base.
        description: Description of the robot.
        bodies: Draws the links.
    """

    def __init__(self, scene: viser.SceneApi, parent: str, description: SceneDescription, bodies: ArmBodies):
        self.description, self._bodies = description, bodies
        """What it looks like."""
        self._node = scene.add_frame(parent, show_axes=False, position=base_m(remote=True))
        add_platform(scene, parent, description)
        self._receptacle = ReceptacleDrawing(scene, parent, description)
        frame = self._receptacle.name
        self._model, self._line = Ellipsoids(scene, frame), Curves(scene, f"{frame}/path", 6.0)
        self._ghost = scene.add_frame(f"{frame}/ghost", show_axes=False, visible=False)
        seen = (*description.tool.meshes, *description.held)
        add_solids(scene, f"{frame}/ghost", seen, palette.PREDICTED, opacity=_GHOST_OPACITY)
        self._path: PlannedPath | None = None
        self._shown: tuple[Telemetry, bool] | None = None

    def remove(self) -> None:
        """Remove it from the scene; `bodies` stay."""
        self._node.remove()

    def draw(self, picture: ConsoleState, now_s: float) -> Ghost | None:
        """Show the newest report and the prediction; return the prediction."""
        robot = picture.robot
        if robot is None:
            return None
        self._draw_report(robot, old=picture.link.health is not LinkHealth.OK)
        has = picture.robot_model
        self._model.show(has.model if has is not None else None, robot.component)
        arrived = picture.phase.at_end
        self._draw_path(None if arrived else shown_path(picture))
        ghost = None if arrived else predict(picture, now_s)
        if ghost is not None:
            put(self._ghost, self.description.tool_at(ghost.point))
        show(self._ghost, ghost is not None)
        return ghost

    def _draw_report(self, robot: Telemetry, old: bool) -> None:
        if self._shown is not None and self._shown[0] is robot and self._shown[1] == old:
            return
        self._shown = robot, old
        if robot.arm is not UNSET:
            self._bodies.draw(REMOTE, robot.arm.joints_rad)
        self._bodies.draw_age(old)
        self._receptacle.draw(reported_frame(robot), old)

    def _draw_path(self, path: PlannedPath | None) -> None:
        if path is self._path:
            return
        self._path = path
        curves = [points_of(path)[:, :3]] if path is not None else []
        self._line.show(curves, [palette.many([palette.PREDICTED])] * len(curves))
