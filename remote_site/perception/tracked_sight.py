"""Sight of a receptacle by a perception of the user's own: filtered and predicted like the simulated tracker's."""

from __future__ import annotations

import numpy as np

from farhand.common.model.manifold import POSE
from farhand.common.model.task_frame import TaskFrame
from farhand.remote_site.interface.driver import Monitored, call_all, halts_of
from farhand.remote_site.interface.sensing import Perception, check_frames
from farhand.remote_site.perception.target_filter import AdaptiveFilter, Estimate

_MISSING_S = 0.3
"""Age of the newest look from which the receptacle counts as unseen [s]."""
_NOISE_STD = (0.002, 0.01)
"""Standard deviation of a camera's measurement per axis, unless it says its own [m, rad]."""


class TrackedSight:
    """Perception that also estimates the velocity of its last frame, with a covariance.

    A look counts as a measurement if the perception returns another list than at the last one: a camera that is slower
    than the control loop returns the same list until it has a new picture.

    Args:
        perception: Sight of poses, started. Its `noise_std`, if it has one, is the standard deviation of its
            measurements per axis [m, rad].
        n_frames: Number of task frames; the last one is the receptacle's.

    Raises:
        InvalidInput: When the perception's frames are not of the agreed form, in `observe`.
    """

    def __init__(self, perception: Perception, n_frames: int):
        self._perception, self._n_frames = perception, n_frames
        self._halts = halts_of(perception)
        self._monitored = perception if isinstance(perception, Monitored) else None
        self._filter = AdaptiveFilter(getattr(perception, "noise_std", _NOISE_STD))
        self._last: list[TaskFrame] | None = None
        self.newest: Estimate | None = None
        """See `TrackedPerception`."""

    @property
    def fault(self) -> str:
        """See `Monitored`."""
        return self._monitored.fault if self._monitored is not None else ""

    def halt(self) -> None:
        """See `Haltable`."""
        call_all(self._halts)

    def observe(self, now_s: float) -> list[TaskFrame] | None:
        """See `Perception.observe`."""
        frames = self._perception.observe(now_s)
        if frames is not None and frames is not self._last:
            check_frames(frames, self._n_frames, POSE.n_dims)
            self._filter.update(np.concatenate([frames[-1].b, frames[-1].quat_wxyz]), now_s)
        self._last = frames
        seen_s = self._filter.time_s
        if frames is None or seen_s is None or now_s - seen_s > _MISSING_S:
            self.newest = None
            return None
        self.newest = self._filter.estimate(now_s)
        return [*frames[:-1], TaskFrame.at(self.newest.point)]
