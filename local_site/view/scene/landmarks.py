"""Task frames beside the goal's, drawn as axes with their names, at the operator's site and as the robot sees them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import viser
from msgspec import UNSET
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from farhand.common.model.task_frame import TaskFrame
from farhand.common.wire.messages import Telemetry
from farhand.local_site.view.scene.nodes import SEEN_UNCHANGED, put, show

Array = NDArray[np.float64]

_LENGTH_M, _RADIUS_M = 0.06, 0.004


def own_places(frames: Sequence[TaskFrame]) -> list[Array]:
    """Return the places of the operator's own frames but the goal's, as poses. Each of shape (7,)."""
    return [_pose(frame.b, Rotation.from_matrix(_of_space(frame.A)).as_rotvec()) for frame in frames[:-1]]


def reported_places(robot: Telemetry) -> list[Array]:
    """Return the places of the frames but the goal's, as the robot sees them, as poses. Each of shape (7,)."""
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
    """Drawing of frames below a node. Used by the page's thread.

    Args:
        scene: Scene of the server.
        parent: Name of the node of the board, or of the arm's base.
    """

    def __init__(self, scene: viser.SceneApi, parent: str):
        self._scene, self._name = scene, f"{parent}/landmarks"
        self._nodes: dict[str, viser.FrameHandle] = {}

    def draw(self, names: Iterable[str], places: Sequence[Array]) -> None:
        """Draw frames at their places, and hide those that are not there. Places of shape (7,)."""
        at = dict(zip(names, places, strict=False))
        for name, node in self._nodes.items():
            show(node, name in at)
        for name, place in at.items():
            if name not in self._nodes:
                self._nodes[name] = self._add(name)
            put(self._nodes[name], place, SEEN_UNCHANGED)

    def _add(self, name: str) -> viser.FrameHandle:
        node = self._scene.add_frame(
            f"{self._name}/{name}",
            axes_length=_LENGTH_M,
            axes_radius=_RADIUS_M,
            origin_radius=2.0 * _RADIUS_M,
        )
        self._scene.add_label(
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
