"""Task frames beside the goal's, drawn as axes with their names, at the operator's site and as the robot sees them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import viser
from msgspec import UNSET
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from farhand.common.model.task_frame import TaskFrame
from farhand.common.wire.messages import Telemetry
from farhand.local_site.view.panels.words.controls import high
from farhand.local_site.view.scene.nodes import LINE_Z_M, SEEN_UNCHANGED, put, show

Array = NDArray[np.float64]

_LENGTH_M, _RADIUS_M = 0.06, 0.004


def own_places(frames: Sequence[TaskFrame]) -> list[Array]:
    """Return the places of the operator's own frames, as poses. Each of shape (7,)."""
    return [_pose(frame.b, Rotation.from_matrix(_of_space(frame.A)).as_rotvec()) for frame in frames]


def reported_places(robot: Telemetry) -> list[Array]:
    """Return the places of the frames as the robot sees them, as poses. Each of shape (7,)."""
    goal = _pose(np.array(robot.frame_origin_m), np.array(robot.frame_rotation_rad or (0.0,)))
    return [*_others(robot), goal]


def _others(robot: Telemetry) -> list[Array]:
    if robot.other_frames is UNSET:
        return []
    n_dims = len(robot.position_m)
    width = 3 if n_dims == 2 else 6
    numbers = np.array(robot.other_frames)
    return [
        _pose(row[:n_dims], row[n_dims:])
        for row in numbers[: numbers.size // width * width].reshape(-1, width)
    ]


class Landmarks:
    """Drawing of the frames beside the goal's, below a node. Used by the page's thread.

    Args:
        scene: Scene of the server.
        parent: Name of the node of the board, or of the arm's base.
        from_above: True on the board of a task in space: the frames lie on the board, the goal's, too, and their names say
            how high they are.
    """

    def __init__(self, scene: viser.SceneApi, parent: str, from_above: bool = False):
        self._scene, self._name, self._from_above = scene, f"{parent}/landmarks", from_above
        self._nodes: dict[str, viser.FrameHandle] = {}
        self._labels: dict[str, viser.LabelHandle] = {}

    def draw(self, names: Sequence[str], places: Sequence[Array]) -> None:
        """Draw the frames at their places, and hide those that are not there. Places of shape (7,), the goal's last."""
        at = dict(zip(names, places if self._from_above else places[:-1], strict=False))
        for name, node in self._nodes.items():
            show(node, name in at)
        for name, place in at.items():
            if name not in self._nodes:
                self._nodes[name] = self._add(name)
            put(self._nodes[name], self._seen(name, place), SEEN_UNCHANGED)

    def _seen(self, name: str, place: Array) -> Array:
        """Return a place as it is drawn, and tell its height where that cannot be seen."""
        if not self._from_above:
            return place
        words, label = high(name, (float(place[2]),)), self._labels[name]
        if label.text != words:
            label.text = words
        return np.concatenate([place[:2], [LINE_Z_M], place[3:]])

    def _add(self, name: str) -> viser.FrameHandle:
        node = self._scene.add_frame(
            f"{self._name}/{name}",
            axes_length=_LENGTH_M,
            axes_radius=_RADIUS_M,
            origin_radius=2.0 * _RADIUS_M,
        )
        self._labels[name] = self._scene.add_label(
            f"{self._name}/{name}/name", name, position=(0.0, -0.3 * _LENGTH_M, 0.0), anchor="top-center"
        )
        return node


def _of_space(A: Array) -> Array:
    """Return a rotation of the plane as one of space about the third axis."""
    whole = np.eye(3)
    whole[: len(A), : len(A)] = A
    return whole


def _pose(origin_m: Array, turn_rad: Array) -> Array:
    """Return a pose of space, with a height of zero on a board."""
    position = np.concatenate([origin_m, np.zeros(3 - len(origin_m))])
    turn = turn_rad if len(turn_rad) == 3 else np.array([0.0, 0.0, *turn_rad])
    return np.concatenate([position, Rotation.from_rotvec(turn).as_quat(scalar_first=True)])
