"""The arm task's scene: the operator's arm on the left, the robot on the right, seen alike."""

from __future__ import annotations

from collections.abc import Callable

import viser

from common.scene_description import SceneDescription
from local_site import intents
from local_site.picture import Picture
from local_site.view.arm_bodies import LOCAL, ArmBodies
from local_site.view.arm_camera import FOV_RAD, arm_camera, base_m
from local_site.view.arm_remote import RemoteArm
from local_site.view.ellipsoids import Ellipsoids
from local_site.view.ghost import Ghost
from local_site.view.hand_gizmo import Act, HandGizmo
from local_site.view.pose_curves import Demonstrations
from local_site.view.receptacle_drawing import ReceptacleDrawing, add_platform
from local_site.view.water import add_water

_LOCAL, _REMOTE = "/local", "/remote"


class ArmScene:
    """What the canvas shows, and what the mouse does on it. Used by the page's thread.

    Args:
        scene: Of the server.
        description: What both arms look like.
        submit: To the console.
        act: Enqueues what a tab does.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        description: SceneDescription,
        submit: Callable[[intents.Intent], None],
        act: Act,
    ):
        scene.set_up_direction("+z")
        add_water(scene)
        for name, remote in ((_LOCAL, False), (_REMOTE, True)):
            scene.add_frame(name, show_axes=False, position=base_m(remote))
        self._bodies = ArmBodies(scene, description)
        add_platform(scene, _LOCAL, description)
        self._receptacle = ReceptacleDrawing(scene, _LOCAL, description)
        self._model = Ellipsoids(scene, self._receptacle.name)
        self._demonstrations = Demonstrations(scene, self._receptacle.name)
        self._gizmo = HandGizmo(scene, _LOCAL, submit, act)
        self._remote = RemoteArm(scene, _REMOTE, description, self._bodies)

    def draw(self, picture: Picture, now_s: float) -> Ghost | None:
        """Show the newest picture; returns where the robot is expected to be by now."""
        arm = picture.own_arm
        if arm is not None:
            self._bodies.draw(LOCAL, arm.joints_rad)
            self._receptacle.draw(arm.receptacle)
            self._gizmo.draw(arm.tip)
        self._model.show(picture.forming or (picture.learned.model if picture.learned else None))
        self._demonstrations.draw(picture)
        return self._remote.draw(picture, now_s)

    def let_go(self) -> None:
        """The tab that held the hand is gone."""
        self._gizmo.let_go()

    def fit(self, camera: viser.CameraHandle) -> None:
        """Have both arms fill a tab's canvas."""
        view = arm_camera((camera.image_width, camera.image_height))
        camera.fov = FOV_RAD
        camera.up_direction = (0.0, 0.0, 1.0)
        camera.position = tuple(view.position_m)
        camera.look_at = tuple(view.centre_m)
