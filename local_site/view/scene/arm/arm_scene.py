"""Scene of an arm's task: the operator's arm on the left, the robot on the right, with light and water."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import viser

from farhand.common.wire.scene_description import SceneDescription
from farhand.local_site.console import intents
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.view.scene import palette
from farhand.local_site.view.scene.arm.arm_bodies import LOCAL, REMOTE, ArmBodies
from farhand.local_site.view.scene.arm.arm_camera import FOV_RAD, arm_camera, base_m
from farhand.local_site.view.scene.arm.arm_remote import RemoteArm
from farhand.local_site.view.scene.arm.ellipsoids import Ellipsoids
from farhand.local_site.view.scene.arm.hand_gizmo import Act, HandGizmo
from farhand.local_site.view.scene.arm.pose_curves import Demonstrations
from farhand.local_site.view.scene.arm.receptacle_drawing import ReceptacleDrawing, add_platform
from farhand.local_site.view.scene.ghost import Ghost

_LOCAL, _REMOTE, _ARMS, _ROBOT = "/local", "/remote", "/arms", "/robot"


class ArmScene:
    """Canvas of an arm's task with the mouse's actions on it. Used by the page's thread.

    Args:
        scene: Scene of the server.
        own: Description of the operator's arm; the robot is drawn once its description is known.
        submit: Hands an intent to the console.
        act: Enqueues a tab's action.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        own: SceneDescription,
        submit: Callable[[intents.Intent], None],
        act: Act,
    ):
        scene.set_up_direction("+z")
        add_water(scene)
        self._scene, self._own = scene, own
        scene.add_frame(_LOCAL, show_axes=False, position=base_m(remote=False))
        self._bodies = ArmBodies(scene, _ARMS, own, (LOCAL,))
        self._remote: RemoteArm | None = None
        self._robots_own: ArmBodies | None = None
        add_platform(scene, _LOCAL, own)
        self._receptacle = ReceptacleDrawing(scene, _LOCAL, own)
        self._model = Ellipsoids(scene, self._receptacle.name)
        self._demonstrations = Demonstrations(scene, self._receptacle.name)
        self._gizmo = HandGizmo(scene, _LOCAL, submit, act)

    def draw(self, picture: ConsoleState, now_s: float) -> Ghost | None:
        """Show the newest picture; return where the robot is expected to be now."""
        robot = picture.robot_scene
        if robot is not None and (self._remote is None or self._remote.description is not robot):
            self._meet(robot)
        arm = picture.own_arm
        if arm is not None:
            self._bodies.draw(LOCAL, arm.joints_rad)
            self._receptacle.draw(arm.receptacle)
            self._gizmo.draw(arm.tip)
        self._model.show(picture.forming or (picture.learned.model if picture.learned else None))
        self._demonstrations.draw(picture)
        return self._remote.draw(picture, now_s) if self._remote is not None else None

    def _meet(self, robot: SceneDescription) -> None:
        """Draw the robot; if both arms look alike, they share one drawing."""
        for drawn in (self._remote, self._robots_own, self._bodies):
            if drawn is not None:
                drawn.remove()
        alike = robot.sha256 == self._own.sha256
        self._bodies = ArmBodies(self._scene, _ARMS, self._own, (LOCAL, REMOTE) if alike else (LOCAL,))
        self._robots_own = None if alike else ArmBodies(self._scene, _ROBOT, robot, (REMOTE,))
        self._remote = RemoteArm(self._scene, _REMOTE, robot, self._robots_own or self._bodies)

    def let_go(self) -> None:
        """End the drag of a closed tab."""
        self._gizmo.let_go()

    def fit(self, camera: viser.CameraHandle) -> None:
        """Fit both arms into a tab's canvas."""
        view = arm_camera((camera.image_width, camera.image_height))
        camera.fov = FOV_RAD
        camera.up_direction = (0.0, 0.0, 1.0)
        camera.position = tuple(view.position_m)
        camera.look_at = tuple(view.centre_m)


def add_water(scene: viser.SceneApi) -> None:
    """Set the scene's background and lights."""
    scene.configure_default_lights(enabled=False, cast_shadow=False)
    scene.configure_environment_map(hdri=None)
    below = np.linspace(0.0, 1.0, 256)[:, None, None]
    water = (1.0 - below) * palette.WATER_ABOVE + below * palette.WATER
    scene.set_background_image(np.broadcast_to(water, (256, 8, 3)).astype(np.uint8), format="png")
    scene.add_light_ambient("/light/ambient", intensity=0.8)
    scene.add_light_hemisphere(
        "/light/surface", sky_color=(205, 238, 255), ground_color=(20, 45, 55), intensity=1.3
    )
    scene.add_light_directional("/light/key", intensity=2.2, position=(-2.5, -2.0, 4.0))
    scene.add_light_directional("/light/fill", intensity=0.8, position=(-2.0, 3.0, 1.0))
