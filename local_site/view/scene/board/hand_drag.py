"""Hand on a board: drags that teach or drive, the drag that moves the simulated target, and the strokes as they are drawn."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import viser

from farhand.common.clock import elapsed_s
from farhand.common.task import PointTask
from farhand.local_site.console import intents
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.view.panels.words.controls import NOTHING_FOLLOWS, Layer
from farhand.local_site.view.scene import palette, shapes
from farhand.local_site.view.scene.board.boards import Board
from farhand.local_site.view.scene.nodes import LINE_Z_M, MARK_Z_M, Layers, add_flat, add_lines, place, show

HAND_SPEED_M_S = 0.3
"""Assumed speed of a drawn stroke: the browser's event times show its load, not the motion [m/s]."""
_HAND_RADIUS_M = 0.012


class StrokeClock:
    """Clock of a stroke that runs with the length of its path, independent of the browser's pace."""

    def __init__(self) -> None:
        self._last: tuple[float, ...] | None = None
        self.time_s = 0.0

    def at(self, position_m: tuple[float, ...]) -> float:
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
        task: Task that is taught on it; of one in space the board is the ground, and the hand has a height.
        submit: Hands an intent to the console.
        explain: Tells the operator something.
        layers: What the operator hides and shows.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        board: Board,
        task: PointTask,
        submit: Callable[[intents.Intent], None],
        explain: Callable[[str], None],
        layers: Layers,
    ):
        self._shown_name = layers.node(Layer.DEMONSTRATIONS, f"{board.name}/shown")
        self._scene, self._submit, self._explain, self._layers = scene, submit, explain, layers
        self._clock = StrokeClock()
        self._recording = self._coupled = False
        self._hand_at: tuple[float, float] | None = None
        self.height_m = task.start_m[2:]
        """Height of the hand over the board, empty in the plane [m]."""
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
        self._move(position_m, released=phase == "end")

    def lift(self, height_m: float) -> None:
        """Move the hand to another height over the board, also while it draws or drives [m]."""
        self.height_m = (height_m,)
        if self._hand_at is not None:
            self._move(self._hand_at)

    def _move(self, position_m: tuple[float, float], released: bool = False) -> None:
        point = (*position_m, *self.height_m)
        self._submit(intents.Hand(point, self._clock.at(point), released))

    def let_go(self) -> None:
        """End the drag of a closed tab."""
        if self._coupled and self._hand_at is not None:
            self._move(self._hand_at, released=True)

    def draw(self, state: ConsoleState) -> None:
        """Show the strokes and the hand."""
        if state.recording and not self._recording:
            self._clock = StrokeClock()
        self._recording, self._coupled = state.recording, state.coupled
        hidden = [name in self._layers.hidden_demonstrations for name in state.demonstration_names]
        shown = (state.task.name, *map(len, state.strokes), *hidden)
        if shown != self._shown:
            self._shown = shown
            self._draw_strokes(state, hidden)
        if not (self._recording or self._coupled):
            self._hand_at = None
        if self._hand_at is not None:
            place(self._hand, *self._hand_at, MARK_Z_M)
        show(self._hand, self._hand_at is not None)

    def _draw_strokes(self, state: ConsoleState, hidden: list[bool]) -> None:
        """Draw the strokes as one set of lines: ended ones grey unless hidden, the present one white."""
        points, colours = [], []
        for index, stroke in enumerate(state.strokes):
            if index < len(hidden) and hidden[index]:
                continue
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
        self.height_m: tuple[float, ...] = ()
        """Height of the target, empty in the plane [m]."""

    def drag(self, phase: str, position_m: tuple[float, float]) -> None:
        """Send the dragged position of the U [m]."""
        now_s = elapsed_s()
        if phase == "end" or now_s - self._sent_s >= _PERIOD_S:
            self._sent_s = now_s
            self._submit(intents.DragTarget((*position_m, *self.height_m)))
