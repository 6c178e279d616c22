"""Curves in space below a node: polylines that are changed in place, and the trace of the robot's newest execution."""

from __future__ import annotations

import numpy as np
import viser
from numpy.typing import NDArray

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


class Trace:
    """Curve along which the robot's tip went, in the coordinates of a node that is the task frame.

    It is drawn over the demonstrations, too, so that both can be compared.

    Args:
        scene: Scene of the server.
        parent: Name of the node.
        above_m: Height over the plane of a board [m].
    """

    def __init__(self, scene: viser.SceneApi, parent: str, above_m: float = 0.0):
        self._above_m = above_m
        self._curve = Curves(scene, f"{parent}/curve", 4.5)
        self._shown: Array | None = None

    def show(self, trace: Array | None) -> None:
        """Show a trace, or none. Shape (n, D) [m]."""
        if trace is not self._shown:
            self._shown = trace
            curves = [in_space(thinned(trace), self._above_m)] if trace is not None else []
            self._curve.show(curves, [palette.many([palette.REMOTE])] * len(curves))


def in_space(points: Array, above_m: float = 0.0) -> Array:
    """Return the positions of points or poses (T, C) in space; those in a plane at a height [m]. Shape (T, 3)."""
    if points.shape[1] > 2:
        return points[:, :3]
    return np.column_stack([points, np.full(len(points), above_m)])


def thinned(points: Array) -> Array:
    """Thin a curve to a visible number of points, including its end. Shape (T, C)."""
    if len(points) <= _LONGEST:
        return points
    return points[np.linspace(0, len(points) - 1, _LONGEST).round().astype(int)]


def _segments(points: NDArray) -> NDArray:
    return np.stack([points[:-1], points[1:]], axis=1)
