"""Scene of the planar task: both boards with everything on them, seen straight from above.

Drags on the boards: strokes that teach or drive, and the drag that moves the simulated target.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import numpy as np
import viser

from farhand.common.clock import elapsed_s
from farhand.common.task import PointTask
from farhand.local_site.console import intents
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.view.panels.words.controls import NOTHING_FOLLOWS, OWN_BOARD, Layer
from farhand.local_site.view.scene import palette, shapes
from farhand.local_site.view.scene.board.board_jog import BoardJog
from farhand.local_site.view.scene.board.boards import FOV_RAD, VIEWS, Board, add_mat, view_of
from farhand.local_site.view.scene.board.robot_drawing import ModelDrawing, RobotDrawing, add_target
from farhand.local_site.view.scene.curves import Trace
from farhand.local_site.view.scene.ghost import RobotPicture
from farhand.local_site.view.scene.landmarks import Landmarks, own_places
from farhand.local_site.view.scene.nodes import (
    LINE_Z_M,
    MARK_Z_M,
    MAT_Z_M,
    Layers,
    add_flat,
    add_lines,
    place,
    show,
)

HAND_SPEED_M_S = 0.3
"""Assumed speed of a drawn stroke: the browser's event times show its load, not the motion [m/s]."""
_HAND_RADIUS_M = 0.012


class StrokeClock:
    """Clock of a stroke that runs with the length of its path, independent of the browser's pace."""

    def __init__(self) -> None:
        self._last: tuple[float, float] | None = None
        self.time_s = 0.0

    def at(self, position_m: tuple[float, float]) -> float:
        """Return the time of the motion at the hand's new position [s]."""
        if self._last is not None:
            self.time_s += math.dist(self._last, position_m) / HAND_SPEED_M_S
        self._last = position_m
        return self.time_s


class Drawing:
    """Converter of drags on the local board into intents, and drawing of the strokes. Used by the page's thread.

    Args:
        scene: Scene of the server.
        board: Local board.
        submit: Hands an intent to the console.
        explain: Tells the operator something.
        layers: What the operator hides and shows.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        board: Board,
        submit: Callable[[intents.Intent], None],
        explain: Callable[[str], None],
        layers: Layers,
    ):
        self._shown_name = layers.node(Layer.DEMONSTRATIONS, f"{board.name}/shown")
        self._scene, self._submit, self._explain = scene, submit, explain
        self._clock = StrokeClock()
        self._recording = self._coupled = False
        self._hand_at: tuple[float, float] | None = None
        self._shown: tuple[object, ...] = ()
        self._lines: viser.LineSegmentsHandle | None = None
        self._hand = add_flat(
            scene, f"{board.name}/hand", shapes.disc(_HAND_RADIUS_M), palette.LOCAL, MARK_Z_M, visible=False
        )

    def drag(self, phase: str, position_m: tuple[float, float]) -> None:
        """Handle the mouse: moved with its button down, or let go."""
        if not (self._recording or self._coupled):
            if phase == "start":
                self._explain(NOTHING_FOLLOWS)
            return
        self._hand_at = position_m
        self._submit(intents.Hand(position_m, self._clock.at(position_m), released=phase == "end"))

    def let_go(self) -> None:
        """End the drag of a closed tab."""
        if self._coupled and self._hand_at is not None:
            self._submit(intents.Hand(self._hand_at, self._clock.time_s, released=True))

    def draw(self, state: ConsoleState) -> None:
        """Show the strokes and the hand."""
        if state.recording and not self._recording:
            self._clock = StrokeClock()
        self._recording, self._coupled = state.recording, state.coupled
        shown = (state.task.name, *map(len, state.strokes))
        if shown != self._shown:
            self._shown = shown
            self._draw_strokes(state)
        if not (self._recording or self._coupled):
            self._hand_at = None
        if self._hand_at is not None:
            place(self._hand, *self._hand_at, MARK_Z_M)
        show(self._hand, self._hand_at is not None)

    def _draw_strokes(self, state: ConsoleState) -> None:
        """Draw all strokes as one set of lines: ended ones grey, the present one white."""
        points, colours = [], []
        for index, stroke in enumerate(state.strokes):
            current = (
                state.recording
                and index == len(state.strokes) - 1
                and len(state.strokes) > (state.n_demonstrations)
            )
            thinned = stroke if len(stroke) < 3 else np.vstack([stroke[:-1:2], stroke[-1:]])
            lines = shapes.segments(thinned, LINE_Z_M)
            points.append(lines)
            colour = palette.many([palette.CURRENT_STROKE if current else palette.STROKE])
            colours.append(np.broadcast_to(colour, lines.shape))
        if self._lines is not None and not sum(map(len, points)):
            self._lines.visible = False
        elif points:
            self._lines = add_lines(
                self._scene,
                f"{self._shown_name}/strokes",
                np.concatenate(points),
                np.concatenate(colours),
                3.0,
            )


_PERIOD_S = 0.1


class TargetDrag:
    """Sender of the U's dragged position, at most ten times a second, and of its last one.

    Args:
        submit: Hands an intent to the console.
    """

    def __init__(self, submit: Callable[[intents.Intent], None]):
        self._submit = submit
        self._sent_s = float("-inf")

    def drag(self, phase: str, position_m: tuple[float, float]) -> None:
        """Send the dragged position of the U [m]."""
        now_s = elapsed_s()
        if phase == "end" or now_s - self._sent_s >= _PERIOD_S:
            self._sent_s = now_s
            self._submit(intents.DragTarget(position_m))


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
        self._drawing = Drawing(scene, local, submit, explain, self.layers)
        self._robot, self._landmarks = RobotDrawing(scene, remote, self.layers), Landmarks(scene, local.name)
        self.jog = BoardJog(self._drawing.drag, local.size_m)
        """Moves the hand by gamepad and keys."""
        width, height = local.size_m
        scene.add_label(
            f"{local.name}/name", OWN_BOARD, position=(0.5 * width, height, MAT_Z_M), anchor="top-center"
        )
        target = TargetDrag(submit)
        local.listen(local.grip, lambda tab, *drag: act(tab, partial(self._drawing.drag, *drag)))
        remote.listen(self._robot.grip, lambda tab, *drag: act(tab, partial(target.drag, *drag)))

    def draw(self, state: ConsoleState, picture: RobotPicture) -> None:
        """Draw the newest state of the console, and the robot's half."""
        self._model.show(state.forming or (state.learned.model if state.learned else None))
        self._drawing.draw(state)
        self._trace.show(picture.trace)
        x, y = state.own_frames[-1].b[:2]
        place(self._target, float(x), float(y), 0.0)
        self._landmarks.draw(state.task.frame_names, own_places(state.own_frames))
        self._robot.draw(picture)

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
