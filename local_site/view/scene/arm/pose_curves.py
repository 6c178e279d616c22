"""Curves in space: demonstrations coloured by the components that they teach, and the planned path."""

from __future__ import annotations

import numpy as np
import viser
from numpy.typing import NDArray

from farhand.common.model.tphsmm import TPHSMM
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.view.scene import palette

Array = NDArray[np.float64]

_LONGEST = 120
"""Points of a drawn curve."""


class Curves:
    """Curves below a node, changed in place. Used by the page's thread.

    Args:
        scene: Scene of the server.
        name: Name of the node.
        width_px: Thickness on the screen.
    """

    def __init__(self, scene: viser.SceneApi, name: str, width_px: float):
        self._scene, self._name, self._width_px = scene, name, width_px
        self._node: viser.LineSegmentsHandle | None = None

    def show(self, curves: list[Array], colours: list[NDArray[np.uint8]]) -> None:
        """Show these curves, or none.

        Args:
            curves: Each of shape (T, 3) [m].
            colours: Colours of each curve's points, as `palette.many` makes them. Each of shape (T, 3) or
                (1, 3).
        """
        lines = [_segments(curve) for curve in curves]
        if not sum(map(len, lines)):
            if self._node is not None:
                self._node.remove()
                self._node = None
            return
        points = np.concatenate(lines).astype(np.float32)
        each = [_segments(np.broadcast_to(c, curve.shape)) for c, curve in zip(colours, curves, strict=True)]
        if self._node is None:
            self._node = self._scene.add_line_segments(
                self._name, points, np.concatenate(each), thickness=self._width_px, thickness_units="screen"
            )
        else:
            self._node.points, self._node.colors = points, np.concatenate(each)


class Demonstrations:
    """Curves of the demonstrations, in the coordinates of a node that is the task frame.

    Args:
        scene: Scene of the server.
        parent: Name of the node.
    """

    def __init__(self, scene: viser.SceneApi, parent: str):
        self._ended = Curves(scene, f"{parent}/demonstrations", 3.5)
        self._current = Curves(scene, f"{parent}/demonstration", 4.0)
        self._shown: tuple[object, ...] = ()

    def draw(self, picture: ConsoleState) -> None:
        """Show the ended ones in the components' colours, and the one in progress in white."""
        model = picture.learned.model if picture.learned else None
        shown = (model, *map(len, picture.strokes), picture.n_demonstrations)
        if shown == self._shown:
            return
        self._shown = shown
        curves = [
            thinned(frames[-1].to_local(stroke[:, :3]))
            for stroke, frames in zip(picture.strokes, picture.stroke_frames, strict=True)
        ]
        ended, current = curves[: picture.n_demonstrations], curves[picture.n_demonstrations :]
        self._current.show(current, [palette.many([palette.CURRENT_STROKE])] * len(current))
        self._ended.show(ended, [_by_component(curve, model) for curve in ended])


def thinned(points: Array) -> Array:
    """Thin a curve to as many points as can be seen, including its end. Shape (T, C)."""
    if len(points) <= _LONGEST:
        return points
    return points[np.linspace(0, len(points) - 1, _LONGEST).round().astype(int)]


def _by_component(curve: Array, model: TPHSMM | None) -> NDArray[np.uint8]:
    """Colour each point of a curve by its most likely component."""
    if model is None:
        return palette.many([palette.STROKE])
    covariances = model.covariances[-1, :, :3, :3]
    apart = curve[:, None] - model.means[-1, :, :3]
    distance = np.einsum("tki,kij,tkj->tk", apart, np.linalg.inv(covariances), apart)
    nearest = np.argmin(distance + np.linalg.slogdet(covariances)[1], axis=1)
    return palette.many([palette.component_colour(float(phase)) for phase in model.phase])[nearest]


def _segments(points: NDArray) -> NDArray:
    return np.stack([points[:-1], points[1:]], axis=1)
