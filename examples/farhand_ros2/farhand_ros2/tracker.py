"""Sight of the task frames by poses that a tracker publishes."""

# pyright: reportMissingImports=false

from __future__ import annotations

from functools import partial
from typing import Any

from geometry_msgs.msg import PoseStamped

from farhand import TaskFrame

from .conversion import in_world, task_frame
from .node import RosNode, Topic
from .options import TrackerOptions, read_options
from .transforms import Transforms

TF, TF_STATIC = "/tf", "/tf_static"


class RosTracker:
    """`Perception` of task frames that come as `PoseStamped`, or of frames of TF.

    A message counts as measured when it arrives. A tracker that falls silent is a target out of sight, not a fault.

    Args:
        task: The task, with its frames.
        options: See `TrackerOptions`.

    Raises:
        ValueError: When there is not one topic or TF frame for each task frame, or the frame's pose is impossible.
    """

    def __init__(self, task: Any, options: dict[str, Any]):
        self._options = chosen = read_options(TrackerOptions, options)
        field, names = ("tf_frames", chosen.tf_frames) if chosen.tf_frames else ("poses", chosen.poses)
        if len(names) != len(task.frame_names):
            raise ValueError(
                f"{field}: one for each task frame ({', '.join(task.frame_names)}), got {list(names) or 'none'}"
            )
        if chosen.tf_frames and not chosen.frame_id:
            raise ValueError("frame_id: the frame in which those of tf_frames are looked up")
        _ = chosen.frame.axes  # refuses a quaternion that is none
        self._seen: list[TaskFrame] | None = None
        self._node: RosNode | None = None
        self._transforms, self._told = Transforms(), list[int]()
        if chosen.tf_frames:
            self._topics = [
                Topic[Any](TF, self.take_tf),
                Topic[Any](TF_STATIC, partial(self.take_tf, static=True)),
            ]
        else:
            convert = partial(task_frame, frame=chosen.frame, frame_id=chosen.frame_id)
            self._topics = [Topic[Any](name, convert) for name in chosen.poses]
        self.noise_std = (chosen.noise_m, chosen.noise_rad)
        """Standard deviation of a measurement per axis [m, rad]."""

    def start(self) -> None:
        """Join the domain."""
        self._node = node = RosNode("farhand_tracker", self._options)
        try:
            kind = _tf_message() if self._options.tf_frames else PoseStamped
            for topic in self._topics:
                node.subscribe(kind, topic, kept=topic.name == TF_STATIC)
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
        frames = self._looked_up() if self._options.tf_frames else self._arrived()
        if frames is not None:
            self._seen = frames
        return self._seen

    def take_tf(self, message: Any, static: bool = False) -> bool:
        """Take a `TFMessage`; see `Transforms.take`."""
        return self._transforms.take(message, static)

    def _arrived(self) -> list[TaskFrame] | None:
        """Return the poses that have arrived; None while none is new, or one is missing."""
        frames = [frame for topic in self._topics if (frame := topic.newest) is not None]
        if len(frames) < len(self._topics):
            return None
        old = self._seen
        return frames if old is None or any(a is not b for a, b in zip(frames, old, strict=True)) else None

    def _looked_up(self) -> list[TaskFrame] | None:
        """Return the frames by TF; None while none is new, or a transform is missing."""
        options = self._options
        looked = [self._transforms.lookup(name, options.frame_id) for name in options.tf_frames]
        found = [each for each in looked if each is not None]
        told = [number for _, number in found]
        if len(found) < len(looked) or (told == self._told and any(told)):
            return None
        self._told = told
        return [in_world(frame, options.frame) for frame, _ in found]


def _tf_message() -> Any:
    """Return TF's type of message, which comes with an installed ROS.

    Raises:
        RuntimeError: When it is not here.
    """
    try:
        from tf2_msgs.msg import TFMessage
    except ImportError as error:
        raise RuntimeError("tf_frames: tf2_msgs is not here: install ROS's package, or use poses") from error
    return TFMessage
