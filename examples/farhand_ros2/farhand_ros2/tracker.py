"""Sight of the task frames by poses that a tracker publishes."""

# pyright: reportMissingImports=false

from __future__ import annotations

from functools import partial
from typing import Any

from geometry_msgs.msg import PoseStamped

from farhand import TaskFrame

from .conversion import task_frame
from .node import RosNode, Topic
from .options import TrackerOptions, read_options


class RosTracker:
    """`Perception` of task frames that come as `PoseStamped`.

    A message counts as measured when it arrives. A tracker that falls silent is a target out of sight, not a fault.

    Args:
        task: The task, with its frames.
        options: See `TrackerOptions`.

    Raises:
        ValueError: When there is not one topic for each frame, or the frame's pose is impossible.
    """

    def __init__(self, task: Any, options: dict[str, Any]):
        self._options = chosen = read_options(TrackerOptions, options)
        if len(chosen.poses) != len(task.frame_names):
            names = ", ".join(task.frame_names)
            raise ValueError(
                f"poses: a topic for each task frame ({names}), got {list(chosen.poses) or 'none'}"
            )
        _ = chosen.frame.axes  # refuses a quaternion that is none
        convert = partial(task_frame, frame=chosen.frame, frame_id=chosen.frame_id)
        self._topics = [Topic[TaskFrame](name, convert) for name in chosen.poses]
        self.noise_std = (chosen.noise_m, chosen.noise_rad)
        """Standard deviation of a measurement per axis [m, rad]."""
        self._seen: list[TaskFrame] | None = None
        self._node: RosNode | None = None

    def start(self) -> None:
        """Join the domain."""
        self._node = node = RosNode("farhand_tracker", self._options)
        try:
            for topic in self._topics:
                node.subscribe(PoseStamped, topic)
            node.serve()
        except BaseException:
            node.close()
            raise

    def close(self) -> None:
        """Leave the domain."""
        if self._node is not None:
            self._node.close()

    @property
    def fault(self) -> str:
        """Fault in words: a message that cannot be used; empty for none."""
        complaints = [self._node.fault if self._node is not None else "it has not been started"]
        complaints += [topic.complaint for topic in self._topics]
        return next(filter(None, complaints), "")

    def observe(self, now_s: float) -> list[TaskFrame] | None:
        """Return the newest frames, the same list until one is new; None before all have been seen."""
        frames = [frame for topic in self._topics if (frame := topic.newest) is not None]
        if len(frames) < len(self._topics):
            return None
        if self._seen is None or any(new is not old for new, old in zip(frames, self._seen, strict=True)):
            self._seen = frames
        return self._seen
