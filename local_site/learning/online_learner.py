"""OnlineLearner: a TP-HSMM that grows with every datapoint (Sec. III-A, Algorithm 1).

No datapoint is kept: the learner's memory does not grow with their number. It can be restored to any earlier
`snapshot`, bit for bit; the undo of a demonstration uses this.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import deepcopy

import numpy as np
from numpy.typing import ArrayLike, NDArray

from farhand.common.errors import InvalidDemonstration, InvalidModel
from farhand.common.model.manifold import Manifold
from farhand.common.model.task_frame import TaskFrame
from farhand.common.model.tphsmm import TPHSMM
from farhand.local_site.learning.clusters import Clusters
from farhand.local_site.learning.dp_means import FRAME_RULES, add_end
from farhand.local_site.learning.dwell_statistics import Dwell, Segment, finish
from farhand.local_site.learning.learner_settings import LearnerSettings
from farhand.local_site.learning.learner_state import Snapshot, filled, parameters
from farhand.local_site.learning.motion import Motion
from farhand.local_site.learning.observation import Frames, Observer
from farhand.local_site.learning.sketch import whole_motion
from farhand.local_site.learning.stream import learn_points
from farhand.local_site.learning.way_regression import joined
from farhand.local_site.learning.way_statistics import WayStatistics

Array = NDArray[np.float64]

_FIRST_CAPACITY = 32


class OnlineLearner:
    """Learner of one task from demonstrations, datapoint by datapoint.

    Args:
        settings: Lambda, the minimum covariance and the weights.
        space: Space of the datapoints: `farhand.common.model.manifold.POSE`, or the dimension D of positions.
        frame_names: Names of the task frames; their number is P.
    """

    def __init__(
        self, settings: LearnerSettings, space: Manifold | int, frame_names: Sequence[str] = ("goal",)
    ):
        self.settings = settings
        self.space = space if isinstance(space, Manifold) else Manifold(space)
        self.frame_names = tuple(frame_names)
        self._observer = Observer(self.space, len(self.frame_names))
        self._weights, self._rule = settings.weights, FRAME_RULES.index(settings.frame_rule)
        self._clusters = Clusters.empty(_FIRST_CAPACITY, len(self.frame_names), self.space)
        self._dwell = Dwell.empty(_FIRST_CAPACITY)
        self._ways: tuple[WayStatistics, ...] = ()
        self._motion: Motion | None = None
        self._segment: Segment | None = None
        self._before: Snapshot | None = None

    @property
    def demonstrating(self) -> bool:
        """True between the start and the end of a demonstration."""
        return self._motion is not None

    @property
    def n_components(self) -> int:
        """Number of components so far, the terminal ones included."""
        return int(self._clusters.size[0])

    @property
    def n_points(self) -> int:
        """Number of learned datapoints."""
        return int(self._clusters.counts[~self._clusters.terminal].sum())

    @property
    def n_demonstrations(self) -> int:
        """Number of ended demonstrations."""
        return int(self._dwell.ends.sum())

    def start(self) -> None:
        """Begin a demonstration.

        Raises:
            InvalidDemonstration: When a demonstration is running already.
        """
        if self.demonstrating:
            raise InvalidDemonstration("demonstration", "start", "end or discard the running one first")
        self._before = self.snapshot()
        self._motion = Motion.begin(len(self.frame_names), self.space)
        self._segment = Segment.begin(self._clusters.counts.size)

    def observe(self, point: ArrayLike, frames: Sequence[TaskFrame], time_s: float) -> int:
        """Learn from one datapoint and return its component.

        Args:
            point: Position or pose in the world [m]. Shape (C,).
            frames: The task frames at that time. Length P.
            time_s: Time of the datapoint, later than that of the previous one [s].

        Raises:
            InvalidDemonstration: When the datapoint is malformed or late; nothing is changed.
        """
        return self._learn(*self._observer.seen(point, frames, (time_s,), self._after())).item(0)

    def observe_many(self, points: ArrayLike, frames: Frames, times_s: ArrayLike) -> NDArray[np.int64]:
        """Learn from consecutive datapoints, exactly as one by one, and return their components.

        Args:
            points: Positions or poses in the world [m]. Shape (T, C).
            frames: The task frames, P of them for all datapoints or one such sequence per datapoint.
            times_s: Increasing times [s]. Length T.

        Raises:
            InvalidDemonstration: When a datapoint is malformed or late; nothing is changed.
        """
        return self._learn(*self._observer.seen(points, frames, times_s, self._after()))

    def observe_in_frames(self, points: ArrayLike, times_s: ArrayLike) -> NDArray[np.int64]:
        """Learn from datapoints that were observed separately in each task frame (before Eq. 1).

        Args:
            points: Positions or poses relative to each frame [m]. Shape (T, P, C).
            times_s: Increasing times [s]. Length T.

        Raises:
            InvalidDemonstration: When a datapoint is malformed or late; nothing is changed.
        """
        return self._learn(*self._observer.seen_in_frames(points, times_s, self._after()))

    def _after(self) -> float:
        """Return the time that the next datapoint must exceed [s]."""
        if self._motion is None:
            raise InvalidDemonstration("demonstration", "", "start the demonstration first")
        motion, held = self._motion, self._motion.jumps.counts.item(1)
        if held > 0:
            return motion.jumps.times.item(held - 1)
        return motion.clock.item(0) if motion.component.item(0) >= 0 else -np.inf

    def _learn(self, local: Array, times: Array) -> NDArray[np.int64]:
        assert self._motion is not None
        assert self._segment is not None
        labels, done, s = np.empty(times.size, np.int64), 0, self.settings
        while done < times.size:
            learned = learn_points(
                self._clusters,
                self._motion,
                self._dwell,
                self._segment,
                local[done:] if done else local,
                times[done:] if done else times,
                s.max_distance_m,
                self._weights,
                s.hysteresis,
                self._rule,
                labels[done:] if done else labels,
            )
            done += learned
            if done < times.size:
                self._make_room()
        return labels

    def end(self) -> int:
        """End the demonstration at its last datapoint, and return its terminal component.

        Raises:
            InvalidDemonstration: When no demonstration is running, or it has fewer than two datapoints.
        """
        if self._motion is None or self._segment is None:
            raise InvalidDemonstration("demonstration", "", "start the demonstration first")
        if self._segment.time_count.sum() < 2:
            raise InvalidDemonstration("demonstration", "", "at least two datapoints")
        s = self.settings
        self._make_room()
        terminal = int(add_end(self._clusters, self._motion, s.max_distance_m, self._weights, self._rule))
        self._add_way(self._motion, float(self._segment.clock[0]), terminal)
        finish(self._dwell, self._segment, terminal)
        self._make_room()
        self._motion = self._segment = self._before = None
        return terminal

    def discard(self) -> None:
        """Forget the running demonstration; the learner is as before its start, bit for bit.

        Raises:
            InvalidDemonstration: When no demonstration is running.
        """
        if self._before is None:
            raise InvalidDemonstration("demonstration", "discard", "no demonstration is running")
        self.restore(self._before)

    def snapshot(self) -> Snapshot:
        """Return a copy of the learner's complete state."""
        return Snapshot(
            deepcopy(self._clusters),
            deepcopy(self._dwell),
            self._ways,  # immutable
            deepcopy(self._motion),
            deepcopy(self._segment),
        )

    def restore(self, snapshot: Snapshot) -> None:
        """Restore a snapshot; a demonstration that was running in it continues."""
        if snapshot.motion is None:
            self._before = None
        elif self._before is None:
            raise InvalidDemonstration("demonstration", "restore", "a snapshot from between demonstrations")
        self._clusters, self._dwell = deepcopy(snapshot.clusters), deepcopy(snapshot.dwell)
        self._ways = snapshot.ways
        self._motion, self._segment = deepcopy(snapshot.motion), deepcopy(snapshot.segment)

    def model(self) -> TPHSMM:
        """Return the model learned so far.

        Raises:
            InvalidModel: When no datapoint was learned yet.
        """
        if self.n_components == 0:
            raise InvalidModel("model", "", "at least one demonstration to learn from")
        return parameters(
            self._clusters, self._dwell, self._ways, self.settings, self.frame_names, self.space
        )

    def _add_way(self, motion: Motion, began_s: float, terminal: int) -> None:
        lambda_m = self.settings.max_distance_m
        start, end = (motion.start, began_s), (motion.point, float(motion.clock[0]))
        radian = self.settings.rotation_weight * lambda_m
        whole = whole_motion(motion.sketch, start, end, terminal, self.space, radian)
        if whole is not None:
            self._ways = joined(self._ways, whole, self.space, lambda_m)

    def _make_room(self) -> None:
        """Double the arrays until there is room for a new component and for those of the held-back datapoints."""
        capacity, held = self._clusters.counts.size, 0
        if self._motion is not None:
            held = int(self._motion.jumps.counts[1])
        if self.n_components + held < capacity:
            return
        larger = Clusters.empty(2 * capacity, len(self.frame_names), self.space)
        self._clusters = filled(larger, self._clusters)
        self._dwell = filled(Dwell.empty(2 * capacity), self._dwell)
        if self._segment is not None:
            self._segment = filled(Segment.begin(2 * capacity), self._segment)
        self._make_room()
