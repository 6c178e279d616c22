"""Scene of an arm's task: the operator's arm on the left, the robot on the right, with light and water.

The robot's side is drawn as last reported: its arm, its receptacle with the model, the path, and its ghost.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import viser
from msgspec import UNSET
from numpy.typing import NDArray

from farhand.common.wire.messages import Telemetry
from farhand.common.wire.scene_description import SceneDescription
from farhand.local_site.console import intents
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.view.panels.words.controls import OWN_ARM, ROBOT_NAME, Layer
from farhand.local_site.view.scene import palette
from farhand.local_site.view.scene.arm.arm_bodies import LOCAL, REMOTE, ArmBodies
from farhand.local_site.view.scene.arm.arm_camera import FOV_RAD, TEACHING_VIEW, VIEWS, Half, arm_camera
from farhand.local_site.view.scene.arm.hand_drag import Act, HandGizmo
from farhand.local_site.view.scene.arm.jog import Jog
from farhand.local_site.view.scene.arm.task_drawing import (
    Demonstrations,
    Ellipsoids,
    ReceptacleDrawing,
    add_platform,
)
from farhand.local_site.view.scene.curves import Curves, Trace
from farhand.local_site.view.scene.ghost import (
    RobotPicture,
    reported_frame,
    shown_points,
    unmoved,
)
from farhand.local_site.view.scene.landmarks import Landmarks, own_places, reported_places
from farhand.local_site.view.scene.nodes import Layers, add_solids, put, show
from farhand.local_site.view.scene.palette import Rgb
from farhand.local_site.view.scene.tube import Tube

_GHOST_OPACITY = 0.55
_NAME_M = (0.0, -0.13, 0.26)
"""Place of an arm's name, from its base [m]."""


class RemoteArm:
    """Drawing of the robot's half. Used by the page's thread.

    Args:
        scene: Scene of the server.
        parent: Name of the node of its base.
        description: Description of the robot.
        bodies: Draws the links.
        layers: What the operator hides and shows.
    """

    def __init__(
        self, scene: viser.SceneApi, parent: str, description: SceneDescription, bodies: ArmBodies, layers: Layers
    ):  # fmt: skip
        self.description, self._bodies = description, bodies
        """Description of the robot's drawing."""
        self._node = scene.add_frame(
            parent, show_axes=False, position=Half.of(description).base_m(remote=True)
        )
        add_platform(scene, parent, description)
        self._receptacle, self._landmarks = (
            ReceptacleDrawing(scene, parent, description),
            Landmarks(scene, parent),
        )
        frame = self._receptacle.name
        model, predicted = (
            layers.node(Layer.MODEL, f"{frame}/model"),
            layers.node(Layer.PATH, f"{frame}/predicted"),
        )
        self._model, self._line = Ellipsoids(scene, model), Curves(scene, f"{predicted}/path", 6.0)
        self._tube = Tube(scene, predicted)
        self._ghost = scene.add_frame(f"{predicted}/ghost", show_axes=False, visible=False)
        seen = (*description.tool.meshes, *description.held)
        add_solids(scene, f"{predicted}/ghost", seen, palette.PREDICTED, opacity=_GHOST_OPACITY)
        self._trace = Trace(scene, layers.node(Layer.TRACE, f"{frame}/trace"))
        self._name = scene.add_label(f"{parent}/name", ROBOT_NAME, position=_NAME_M, anchor="center-left")
        self._path: NDArray[np.float64] | None = None
        self._misses = False
        self._shown: tuple[Telemetry, bool] | None = None

    def remove(self) -> None:
        """Remove the drawing from the scene, without `bodies`."""
        self._node.remove()

    def draw(self, picture: RobotPicture) -> None:
        """Show a report of the robot and the prediction."""
        state = picture.state
        robot = state.robot
        if robot is None:
            return
        self._draw_report(robot, picture.old)
        self._landmarks.draw(state.task.frame_names, reported_places(robot))
        self._trace.show(picture.trace)
        name = picture.name(ROBOT_NAME)
        if self._name.text != name:
            self._name.text = name
        has = state.robot_model
        self._model.show(has.model if has is not None else None, robot.component)
        points = None if state.phase.at_end else shown_points(state)
        self._draw_path(points, bool(picture.miss))
        self._tube.show(points, has.model if has is not None else None, state.plan_id)
        if picture.hand is not None:
            put(self._ghost, self.description.tool_at(picture.hand))
        show(self._ghost, picture.hand is not None)

    def _draw_report(self, robot: Telemetry, old: bool) -> None:
        if self._shown is not None and self._shown[0] is robot and self._shown[1] == old:
            return
        self._shown = robot, old
        if robot.arm is not UNSET:
            self._bodies.draw(REMOTE, robot.arm.joints_rad)
        self._bodies.draw_age(old)
        self._receptacle.draw(reported_frame(robot), old)

    def _draw_path(self, points: NDArray[np.float64] | None, misses: bool) -> None:
        if misses == self._misses and unmoved(self._path, points):
            return
        self._path, self._misses = points, misses
        curves = [points[:, :3]] if points is not None else []
        self._line.show(
            curves, [palette.many([palette.MISSES if misses else palette.PREDICTED])] * len(curves)
        )


_LOCAL, _REMOTE, _ARMS, _ROBOT = "/local", "/remote", "/arms", "/robot"
_RINGS = Layer.RINGS
_LAYERS: dict[str, Rgb] = {
    Layer.DEMONSTRATIONS: palette.STROKE, Layer.MODEL: palette.component_colour(0.5), Layer.PATH: palette.PREDICTED,
    Layer.TRACE: palette.REMOTE, _RINGS: palette.LOCAL,
}  # fmt: skip


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
        self.views: tuple[str, ...] = VIEWS
        """Names of the views; the first one shows all."""
        self.teaching_view = TEACHING_VIEW
        """Name of the view in which a demonstration is recorded."""
        scene.set_up_direction("+z")
        add_water(scene)
        self._scene, self._own = scene, own
        self._halves = (Half.of(own), Half.of(own))
        """The operator's half and the robot's, which counts as like it until its description is known."""
        scene.add_frame(_LOCAL, show_axes=False, position=self._halves[0].base_m(remote=False))
        self._bodies = ArmBodies(scene, _ARMS, own, (LOCAL,))
        self._remote: RemoteArm | None = None
        self._robots_own: ArmBodies | None = None
        add_platform(scene, _LOCAL, own)
        self._receptacle, self._landmarks = ReceptacleDrawing(scene, _LOCAL, own), Landmarks(scene, _LOCAL)
        self.layers = Layers(scene, _LAYERS)
        self._model = Ellipsoids(scene, self.layers.node(Layer.MODEL, f"{self._receptacle.name}/model"))
        shown = self.layers.node(Layer.DEMONSTRATIONS, f"{self._receptacle.name}/shown")
        self._demonstrations = Demonstrations(scene, shown, self.layers)
        self._trace = Trace(scene, self.layers.node(Layer.TRACE, f"{self._receptacle.name}/trace"))
        scene.add_label(f"{_LOCAL}/name", OWN_ARM, position=_NAME_M, anchor="center-left")
        self.layers.toggle(_RINGS)
        self._gizmo = HandGizmo(scene, _LOCAL, submit, act)
        self.jog = Jog(self._gizmo.lead, submit, self.turns)
        """Moves the hand by keys and gamepad."""

    def draw(self, state: ConsoleState, picture: RobotPicture) -> None:
        """Draw the newest state of the console, and the robot's half."""
        robot = state.robot_scene
        if robot is not None and (self._remote is None or self._remote.description is not robot):
            self._meet(robot)
        arm = state.own_arm
        if arm is not None:
            self._bodies.draw(LOCAL, arm.joints_rad)
            self._receptacle.draw(arm.receptacle)
            self._gizmo.draw(arm.tip)
            self._gizmo.show_rings(self.turns())
        self._model.show(state.forming or (state.learned.model if state.learned else None))
        self._demonstrations.draw(state)
        self._landmarks.draw(state.task.frame_names, own_places(state.own_frames))
        self._trace.show(picture.trace)
        if self._remote is not None:
            self._remote.draw(picture)

    def _meet(self, robot: SceneDescription) -> None:
        """Draw the robot; if both arms look alike, they share one drawing."""
        for drawn in (self._remote, self._robots_own, self._bodies):
            if drawn is not None:
                drawn.remove()
        alike = robot.sha256 == self._own.sha256
        self._bodies = ArmBodies(self._scene, _ARMS, self._own, (LOCAL, REMOTE) if alike else (LOCAL,))
        self._robots_own = None if alike else ArmBodies(self._scene, _ROBOT, robot, (REMOTE,))
        self._halves = self._halves[0], Half.of(robot)
        self._remote = RemoteArm(self._scene, _REMOTE, robot, self._robots_own or self._bodies, self.layers)

    def lift(self, height_m: float) -> None:
        """Do nothing: an arm is lifted by its arrows [m]."""

    def turns(self) -> bool:
        """Decide whether the rings are shown, and keys and gamepad turn the plug instead of moving it."""
        return self.layers.shown(_RINGS)

    @property
    def extent_m(self) -> tuple[float, ...]:
        """Extent of both halves, which the views fit into a canvas [m]."""
        return tuple(extent for half in self._halves for extent in (half.width_m, half.height_m))

    def let_go(self) -> None:
        """End the drag of a closed tab."""
        self.jog.let_go()
        self._gizmo.let_go()

    def fit(self, camera: viser.CameraHandle, name: str) -> None:
        """Fit a named view into a tab's canvas."""
        view = arm_camera((camera.image_width, camera.image_height), *self._halves, name)
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
