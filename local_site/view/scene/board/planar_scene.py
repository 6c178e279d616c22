"""Scene of the planar task: both boards with everything on them, seen straight from above."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import viser

from farhand.common.task import PointTask
from farhand.local_site.console import intents
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.view.scene.board.boards import FOV_RAD, Board, add_mat, view_of
from farhand.local_site.view.scene.board.drawing import Drawing, TargetDrag
from farhand.local_site.view.scene.board.model_drawing import ModelDrawing
from farhand.local_site.view.scene.board.robot_drawing import RobotDrawing, add_target
from farhand.local_site.view.scene.ghost import Ghost

_LIGHT = 3.14

Act = Callable[[int, Callable[[], None]], None]
"""Has something done on the page's thread, if the tab may act."""


class PlanarScene:
    """Canvas of the planar task with the mouse's actions on it. Used by the page's thread.

    Args:
        scene: Scene of the server.
        task: Its workspace is a board.
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
        # Uniform light: the boards keep the colours of the palette.
        scene.configure_default_lights(enabled=False, cast_shadow=False)
        scene.add_light_ambient("/light", intensity=_LIGHT)
        scene.configure_environment_map(hdri=None)
        scene.set_up_direction("+y")
        local, remote = Board(scene, task, remote=False), Board(scene, task, remote=True)
        self._board_m = local.size_m
        add_mat(scene, local.size_m)
        frame = f"{local.name}/target"
        x, y = task.target.origin_m[:2]
        scene.add_frame(frame, show_axes=False, position=(x, y, 0.0))
        add_target(scene, frame)
        self._model = ModelDrawing(scene, frame)
        self._drawing = Drawing(scene, local, submit, explain)
        self._robot = RobotDrawing(scene, remote)
        target = TargetDrag(submit)
        local.listen(local.grip, lambda tab, *drag: act(tab, partial(self._drawing.drag, *drag)))
        remote.listen(self._robot.grip, lambda tab, *drag: act(tab, partial(target.drag, *drag)))

    def draw(self, picture: ConsoleState, now_s: float) -> Ghost | None:
        """Show the newest picture; return where the robot is expected to be now."""
        self._model.show(picture.forming or (picture.learned.model if picture.learned else None))
        self._drawing.draw(picture)
        return self._robot.draw(picture, now_s)

    def let_go(self) -> None:
        """End the drag of a closed tab."""
        self._drawing.let_go()

    def fit(self, camera: viser.CameraHandle) -> None:
        """Fit both boards into a tab's canvas."""
        view = view_of(self._board_m, (camera.image_width, camera.image_height))
        x, y = view.centre_m
        camera.fov = FOV_RAD
        camera.near, camera.far = 0.2 * view.height_m, 5.0 * view.height_m
        camera.up_direction = (0.0, 1.0, 0.0)
        camera.position = (x, y - 1e-4, view.height_m)
        camera.look_at = (x, y, 0.0)
