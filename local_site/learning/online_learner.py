"""OnlineLearner: a TP-HSMM that grows with every datapoint (Sec. III-A, Algorithm 1).

No datapoint is kept: what the learner remembers does not depend on how many it has seen. It can be put
back to any earlier `snapshot`, bit for bit, which is how the operator undoes a demonstration.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import deepcopy
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from common.errors import InvalidDemonstration, InvalidInput, InvalidModel
from common.gaussian_product import check_frames
from common.manifold import Manifold
from common.task_frame import TaskFrame
from common.tphsmm import TPHSMM
from local_site.learning.clusters import Clusters
from local_site.learning.dp_means import add_end, assign_points
from local_site.learning.dwell_statistics import Dwell, Segment, finish, follow
from local_site.learning.learner_settings import LearnerSettings
from local_site.learning.motion import Motion
from local_site.learning.parameters import parameters

Array = NDArray[np.float64]
Arrays = TypeVar("Arrays", bound=tuple[np.ndarray, ...])

_FIRST_CAPACITY = 32


class Snapshot(NamedTuple):
    """Everything a learner is, as copies."""

    clusters: Clusters
    dwell: Dwell
    motion: Motion | None
    segment: Segment | None


class OnlineLearner:
    """Learns one task from demonstrations, datapoint by datapoint.

    Args:
        settings: Lambda and the rest.
        space: Of the datapoints: `common.manifold.POSE`, or the dimension D of positions.
        frame_names: Names of the task frames; their number is P.
    """

    def __init__(
        self, settings: LearnerSettings, space: Manifold | int, frame_names: Sequence[str] = ("goal",)
    ):
        self.settings = settings
        self.space = space if isinstance(space, Manifold) else Manifold(space)
        self.frame_names = tuple(frame_names)
        self._clusters = Clusters.empty(_FIRST_CAPACITY, len(self.frame_names), self.space)
        self._dwell = Dwell.empty(_FIRST_CAPACITY)
        self._motion: Motion | None = None
        self._segment: Segment | None = None
        self._before: Snapshot | None = None

    @property
    def demonstrating(self) -> bool:
        """Whether a demonstration was started and not yet ended."""
        return self._motion is not None

    @property
    def n_components(self) -> int:
        """Number of components so far, the terminal ones included."""
        return int(self._clusters.size[0])

    @property
    def n_points(self) -> int:
        """Datapoints learned."""
        return int(self._clusters.counts[~self._clusters.terminal].sum())

    @property
    def n_demonstrations(self) -> int:
        """Demonstrations ended."""
        return int(self._dwell.ends.sum())

    def start(self) -> None:
        """Begin a demonstration.

        Raises:
            InvalidDemonstration: When one is running.
        """
        if self.demonstrating:
            raise InvalidDemonstration("demonstration", "start", "end or discard the running one first")
        self._before = self.snapshot()
        self._motion = Motion.begin(len(self.frame_names), self.space)
        self._segment = Segment.begin(self._clusters.counts.size)

    def observe(self, point: Array, frames: Sequence[TaskFrame], time_s: float) -> int:
        """Learn from one datapoint and return its component.

        Args:
            point: Position or pose in the world [m]. Shape (C,).
            frames: The task frames at that time. Length P.
            time_s: Its time, later than that of the one before [s].

        Raises:
            InvalidDemonstration: When it is malformed or late; nothing was changed.
        """
        return int(self.observe_many(np.asarray(point, dtype=float)[None], [frames], [time_s])[0])

    def observe_many(
        self,
        points: Array,
        frames: Sequence[Sequence[TaskFrame]] | Sequence[TaskFrame],
        times_s: Sequence[float] | Array,
    ) -> NDArray[np.int64]:
        """Learn from consecutive datapoints, exactly as one by one, and return their components.

        Args:
            points: Positions or poses in the world [m]. Shape (T, C).
            frames: The task frames, P of them for all datapoints or one such sequence per datapoint.
            times_s: Increasing times [s]. Length T.

        Raises:
            InvalidDemonstration: When any is malformed or late; nothing was changed.
        """
        if self._motion is None or self._segment is None:
            raise InvalidDemonstration("demonstration", "", "start the demonstration first")
        local, times = self._checked(points, frames, times_s)
        labels, done = np.zeros(len(times), np.int64), 0
        s = self.settings
        while done < len(times):
            done += assign_points(
                self._clusters,
                self._motion,
                local[done:],
                times[done:],
                s.max_distance_m,
                s.weights,
                s.hysteresis,
                labels[done:],
            )
            self._make_room()
        follow(self._dwell, self._segment, labels, times)
        return labels

    def end(self) -> int:
        """End the demonstration where it is, and return its terminal component.

        Raises:
            InvalidDemonstration: When none is running or it has fewer than two datapoints.
        """
        if self._motion is None or self._segment is None:
            raise InvalidDemonstration("demonstration", "", "start the demonstration first")
        if self._segment.time_count.sum() < 2:
            raise InvalidDemonstration("demonstration", "", "at least two datapoints")
        s = self.settings
        terminal = int(add_end(self._clusters, self._motion, s.max_distance_m, s.weights))
        finish(self._dwell, self._segment, terminal)
        self._make_room()
        self._motion = self._segment = self._before = None
        return terminal

    def discard(self) -> None:
        """Forget the running demonstration; the learner is as before its start, bit for bit.

        Raises:
            InvalidDemonstration: When none is running.
        """
        if self._before is None:
            raise InvalidDemonstration("demonstration", "discard", "no demonstration is running")
        self.restore(self._before)

    def snapshot(self) -> Snapshot:
        """A copy of all that the learner remembers."""
        return Snapshot(
            deepcopy(self._clusters), deepcopy(self._dwell), deepcopy(self._motion), deepcopy(self._segment)
        )

    def restore(self, snapshot: Snapshot) -> None:
        """Put the learner back to a snapshot; a demonstration that ran then runs again."""
        if snapshot.motion is None:
            self._before = None
        elif self._before is None:
            raise InvalidDemonstration("demonstration", "restore", "a snapshot from between demonstrations")
        self._clusters, self._dwell = deepcopy(snapshot.clusters), deepcopy(snapshot.dwell)
        self._motion, self._segment = deepcopy(snapshot.motion), deepcopy(snapshot.segment)

    def model(self) -> TPHSMM:
        """The model learned so far.

        Raises:
            InvalidModel: When no datapoint was learned yet.
        """
        if self.n_components == 0:
            raise InvalidModel("model", "", "at least one demonstration to learn from")
        return parameters(self._clusters, self._dwell, self.settings, self.frame_names, self.space)

    def _checked(self, points, frames, times_s) -> tuple[Array, Array]:
        """Datapoints in each frame (T, P, C), and times (T,)."""
        try:
            points = self.space.checked(points, "demonstration", "points")
        except InvalidInput as error:
            raise InvalidDemonstration(error.source, error.field, error.expected) from None
        times = np.asarray(times_s, dtype=float)
        if points.ndim != 2 or times.shape != points.shape[:1]:
            expected = (
                f"shapes (T, {self.space.n_coordinates}) and (T,), got {points.shape} and {times.shape}"
            )
            raise InvalidDemonstration("demonstration", "points, times", expected)
        if not np.isfinite(times).all():
            raise InvalidDemonstration("demonstration", "time_s", "finite numbers only")
        assert self._motion is not None
        last = self._motion.clock[0] if self._motion.component[0] >= 0 else -np.inf
        if (np.diff(times, prepend=last) <= 0).any():
            raise InvalidDemonstration("demonstration", "time_s", "times that increase")
        fixed = len(frames) > 0 and isinstance(frames[0], TaskFrame)
        if fixed:
            check_frames(frames, len(self.frame_names), self.space.n_dims)
            return np.ascontiguousarray(np.stack([f.to_local(points) for f in frames], axis=1)), times
        if len(frames) != len(times):
            raise InvalidDemonstration("demonstration", "frames", f"{len(times)} of them, got {len(frames)}")
        local = np.empty((len(times), len(self.frame_names), self.space.n_coordinates))
        for t, present in enumerate(frames):
            check_frames(present, len(self.frame_names), self.space.n_dims)
            local[t] = [frame.to_local(points[t]) for frame in present]
        return local, times

    def _make_room(self) -> None:
        """Double the arrays when they are full."""
        capacity = self._clusters.counts.size
        if self.n_components < capacity:
            return
        larger = Clusters.empty(2 * capacity, len(self.frame_names), self.space)
        self._clusters = _filled(larger, self._clusters)
        self._dwell = _filled(Dwell.empty(2 * capacity), self._dwell)
        if self._segment is not None:
            self._segment = _filled(Segment.begin(2 * capacity), self._segment)


def _filled(larger: Arrays, smaller: Arrays) -> Arrays:
    """Copy the arrays of one tuple into the corners of a larger one's."""
    for target, source in zip(larger, smaller, strict=True):
        target[tuple(slice(n) for n in source.shape)] = source
    return larger
