"""Tree of TF's transforms, and the pose of one frame in another by them. It needs the messages' fields only, and no ROS."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from farhand import TaskFrame

from .conversion import pose_frame


class Edge(NamedTuple):
    """Newest transform of a frame.

    Args:
        parent: Name of the frame in which it is told.
        frame: Its pose there.
        number: Number of the message that told it; 0 for one that never changes.
    """

    parent: str
    frame: TaskFrame
    number: int


class Transforms:
    """Newest transform of each frame, from `/tf` and `/tf_static`. A frame with another parent has moved to that one."""

    def __init__(self) -> None:
        self._edges: dict[str, Edge] = {}
        self._n = 0

    def take(self, message: Any, static: bool = False) -> bool:
        """Take a `TFMessage`.

        Args:
            message: The message.
            static: True for transforms that never change.

        Raises:
            ValueError: When a number is impossible; the others of the message are kept.
        """
        self._n += 1
        complaint: ValueError | None = None
        for each in message.transforms:
            at, turn = each.transform.translation, each.transform.rotation
            try:
                frame = pose_frame(at, turn)
            except ValueError as error:
                complaint = ValueError(f"{each.child_frame_id}: {error}")
                continue
            self._edges[_name(each.child_frame_id)] = Edge(
                _name(each.header.frame_id), frame, 0 if static else self._n
            )
        if complaint is not None:
            raise complaint
        return True

    def lookup(self, name: str, root: str) -> tuple[TaskFrame, int] | None:
        """Return the pose of a frame in another one above it; None while a transform between is missing.

        Returns:
            The pose, and the number of the message that told the lowest transform which can change: that of a tracker, below
            those of the arm that carries its camera. 0 if none can.
        """
        at, frame, number = _name(name), TaskFrame(np.eye(3), np.zeros(3)), 0
        for _ in range(len(self._edges) + 1):
            if at == _name(root):
                return frame, number
            edge = self._edges.get(at)
            if edge is None:
                return None
            frame = TaskFrame(edge.frame.A @ frame.A, edge.frame.A @ frame.b + edge.frame.b)
            at, number = edge.parent, number or edge.number
        return None  # a loop


def _name(name: str) -> str:
    """Return a frame's name without the slash that it had in ROS 1."""
    return name.removeprefix("/")
