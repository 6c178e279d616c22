"""Scene of a point's task: both boards with everything on them, seen straight from above.

Of a task in space a board is the ground: a slider gives the hand its height, and the names say the heights.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import viser

from farhand.common.model.manifold import POSE
from farhand.common.task import PointTask
from farhand.local_site.console import intents
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.view.panels.words.controls import OWN_BOARD, OWN_HAND, Layer, high
from farhand.local_site.view.scene import palette
from farhand.local_site.view.scene.board.board_jog import BoardJog
from farhand.local_site.view.scene.board.boards import FOV_RAD, VIEWS, Board, add_mat, view_of
from farhand.local_site.view.scene.board.hand_drag import Drawing, TargetDrag
from farhand.local_site.view.scene.board.robot_drawing import ModelDrawing, RobotDrawing, add_target
from farhand.local_site.view.scene.curves import Trace
from farhand.local_site.view.scene.ghost import RobotPicture
from farhand.local_site.view.scene.landmarks import Landmarks, own_places
from farhand.local_site.view.scene.nodes import (
    LINE_Z_M,
    MAT_Z_M,
    Layers,
    place,
)

_LIGHT = 3.14

Act = Callable[[int, Callable[[], None]], None]
"""Queues a job for the page's thread, run only if the tab may act."""


_LAYERS: dict[str, palette.Rgb] = {
    Layer.DEMONSTRATIONS: palette.STROKE, Layer.MODEL: palette.component_colour(0.5), Layer.PATH: palette.PREDICTED,
    Layer.TRACE: palette.REMOTE,
}  # fmt: skip


class PlanarScene:
    """Canvas of the planar task with the mouse's actions on it. Used by the page's thread.

    Args:
        scene: Scene of the server.
        task: Task whose workspace is a board.
        submit: Hands an intent to the console.
        explain: Tells the operator something.
        act: Enqueues a tab's action.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        task: PointTask,
        submit: Callable[[intents.Intent], None],
        explain: Callable[[str], None],
        act: Act,
    ):
        self.views: tuple[str, ...] = VIEWS
        """Names of the views; the first one shows all."""
        self.teaching_view = VIEWS[0]
        """Name of the view in which a demonstration is recorded."""
        # Uniform light: the boards keep the colours of the palette.
        scene.configure_default_lights(enabled=False, cast_shadow=False)
        scene.add_light_ambient("/light", intensity=_LIGHT)
        scene.configure_environment_map(hdri=None)
        scene.set_up_direction("+y")
        in_space = task.n_dims == POSE.n_dims
        local, remote = Board(scene, task, remote=False), Board(scene, task, remote=True)
        self._board_m = self.extent_m = local.size_m
        """Size of a board, which the views fit into a canvas [m]."""
        add_mat(scene, local.size_m)
        frame = f"{local.name}/target"
        self._target = scene.add_frame(frame, show_axes=False)
        add_target(scene, frame)
        self.layers = Layers(scene, _LAYERS)
        self._model = ModelDrawing(scene, self.layers.node(Layer.MODEL, f"{frame}/learned"))
        self._trace = Trace(scene, self.layers.node(Layer.TRACE, f"{frame}/trace"), LINE_Z_M)
        self._drawing = Drawing(scene, local, task, submit, explain, self.layers)
        self._robot, self._landmarks = (
            RobotDrawing(scene, remote, self.layers, in_space),
            Landmarks(scene, local.name, in_space),
        )
        self.jog = BoardJog(self._drawing.drag, local.size_m)
        """Moves the hand by gamepad and keys."""
        width, height = local.size_m
        self._name = scene.add_label(
            f"{local.name}/name", OWN_BOARD, position=(0.5 * width, height, MAT_Z_M), anchor="top-center"
        )
        self._dragged = target = TargetDrag(submit)
        local.listen(local.grip, lambda tab, *drag: act(tab, partial(self._drawing.drag, *drag)))
        remote.listen(self._robot.grip, lambda tab, *drag: act(tab, partial(target.drag, *drag)))

    def draw(self, state: ConsoleState, picture: RobotPicture) -> None:
        """Draw the newest state of the console, and the robot's half."""
        self._model.show(state.forming or (state.learned.model if state.learned else None))
        self._drawing.draw(state)
        self._trace.show(None if picture.trace is None else picture.trace[:, :2])
        if state.robot is not None:
            self._dragged.height_m = state.robot.frame_origin_m[2:]
        name = high(OWN_BOARD if not self._drawing.height_m else OWN_HAND, self._drawing.height_m)
        if self._name.text != name:
            self._name.text = name
        x, y = state.own_frames[-1].b[:2]
        place(self._target, float(x), float(y), 0.0)
        self._landmarks.draw(state.task.frame_names, own_places(state.own_frames))
        self._robot.draw(picture)

    def lift(self, height_m: float) -> None:
        """Move the hand to another height over the board of a task in space [m]."""
        self._drawing.lift(height_m)

    def let_go(self) -> None:
        """End the drag of a closed tab."""
        self.jog.let_go()
        self._drawing.let_go()

    def fit(self, camera: viser.CameraHandle, name: str) -> None:
        """Fit a named view into a tab's canvas."""
        view = view_of(self._board_m, (camera.image_width, camera.image_height), name)
        x, y = view.centre_m
        camera.fov = FOV_RAD
        camera.near, camera.far = 0.2 * view.height_m, 5.0 * view.height_m
        camera.up_direction = (0.0, 1.0, 0.0)
        camera.position = (x, y - 1e-4, view.height_m)
        camera.look_at = (x, y, 0.0)
