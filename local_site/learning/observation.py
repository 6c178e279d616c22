"""Datapoints as the learner takes them: checked, and seen from every task frame (Eq. 1)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from farhand.common.errors import InvalidDemonstration
from farhand.common.model.gaussian_product import check_frames
from farhand.common.model.kernel import kernel
from farhand.common.model.manifold import UNIT_TOLERANCE, Manifold
from farhand.common.model.task_frame import FrameArrays, TaskFrame, point_to_local

Array = NDArray[np.float64]
Frames = Sequence[TaskFrame] | Sequence[Sequence[TaskFrame]]


class Observer:
    """Converter of datapoints from the world to the task frames.

    Args:
        space: Of the datapoints.
        n_frames: Number of task frames P.
    """

    def __init__(self, space: Manifold, n_frames: int):
        self._space, self._n_frames = space, n_frames
        self._last_frames: tuple[TaskFrame, ...] = ()
        self._last_arrays: tuple[Array, Array, Array] | None = None

    def seen(
        self, points: ArrayLike, frames: Frames, times_s: ArrayLike, after: float
    ) -> tuple[Array, Array]:
        """Return datapoints in each frame (T, P, C) and their times (T,).

        Args:
            points: Positions or poses in the world. Shape (T, C).
            frames: P task frames for all datapoints, or P for each of them.
            times_s: Their times [s]. Shape (T,).
            after: All times must be later [s].

        Raises:
            InvalidDemonstration: When any is malformed or late.
        """
        points, times = _plain(points, 2), _plain(times_s)
        T, C = times.size, self._space.n_coordinates
        if points.shape != (T, C) or times.ndim != 1:
            raise _invalid("points, times", f"shapes (T, {C}) and (T,), got {points.shape} and {times.shape}")
        A, b, quat = self._arrays(frames, T)
        local = np.empty((T, self._n_frames, C))
        fault = _to_frames(points, times, after, A, b, quat, local)
        if fault:
            raise _invalid(*_FAULTS[fault])
        return local, times

    def seen_in_frames(self, points: ArrayLike, times_s: ArrayLike, after: float) -> tuple[Array, Array]:
        """Return the same for datapoints that were observed in each frame. Shape (T, P, C)."""
        points, times, C = _plain(points), _plain(times_s), self._space.n_coordinates
        if points.ndim != 3 or points.shape[1] != self._n_frames:
            expected = f"shape (T, {self._n_frames}, {C})"
            raise _invalid("points", f"{expected}, got {points.shape}")
        if points.ndim != 3 or points.shape[2] != C or times.shape != points.shape[:1]:
            raise _invalid(
                "points, times", f"shapes (T, {C}) and (T,), got {points[:, 0].shape} and {times.shape}"
            )
        fault = _fault(points, times, after, self._space.n_dims)
        if fault:
            raise _invalid(*_FAULTS[fault])
        return points, times

    def _arrays(self, frames: Frames, n_points: int) -> tuple[Array, Array, Array]:
        """Return the frames' arrays, with one axis more: of length one, or one for every datapoint."""
        if len(frames) > 0 and isinstance(frames[0], TaskFrame):
            fixed = cast(Sequence[TaskFrame], frames)
            known = len(fixed) == len(self._last_frames) and all(map(_is, fixed, self._last_frames))
            if not known or self._last_arrays is None:
                check_frames(fixed, self._n_frames, self._space.n_dims)
                A, b, quat = FrameArrays.of(fixed, self._space.oriented)
                self._last_arrays = A[None], b[None], quat[None]
                self._last_frames = tuple(fixed)
            return self._last_arrays
        if len(frames) != n_points:
            raise _invalid("frames", f"{n_points} of them, got {len(frames)}")
        for present in frames:
            check_frames(cast(Sequence[TaskFrame], present), self._n_frames, self._space.n_dims)
        all_frames = [frame for present in frames for frame in cast(Sequence[TaskFrame], present)]
        arrays = FrameArrays.of(all_frames, self._space.oriented)
        P, D = self._n_frames, self._space.n_dims
        quat = arrays.quat_wxyz.reshape(n_points if self._space.oriented else 0, P, 4)
        return arrays.A.reshape(n_points, P, D, D), arrays.b.reshape(n_points, P, D), quat


def _plain(values: ArrayLike, least_axes: int = 0) -> Array:
    """Return a copy with the memory layout that the kernels are compiled for: writable and contiguous."""
    return np.array(values, dtype=float, ndmin=least_axes, order="C")


def _is(a: object, b: object) -> bool:
    return a is b


def _invalid(field: str, expected: str) -> InvalidDemonstration:
    return InvalidDemonstration("demonstration", field, expected)


_NOT_FINITE, _NOT_UNIT, _NO_TIME, _LATE = 1, 2, 3, 4
_FAULTS = {
    _NOT_FINITE: ("points", "finite numbers only"),
    _NOT_UNIT: ("points", "unit quaternions (w, x, y, z) after the position"),
    _NO_TIME: ("time_s", "finite numbers only"),
    _LATE: ("time_s", "times that increase"),
}


@kernel
def _fault(points, times, after, n_dims):
    """Return the number of the first fault, or zero; normalise quaternions."""
    for t in range(times.size):
        if not np.isfinite(times[t]):
            return _NO_TIME
        if times[t] <= after:
            return _LATE
        after = times[t]
        for p in range(points.shape[1]):
            for k in range(points.shape[2]):
                if not np.isfinite(points[t, p, k]):
                    return _NOT_FINITE
            if points.shape[2] > n_dims and not _made_unit(points[t, p], n_dims):
                return _NOT_UNIT
    return 0


@kernel
def _to_frames(points, times, after, A, b, quat, out):
    """Apply Eq. 1 to points of the world (T, 1, C); write them to out (T, P, C)."""
    T, P, C = out.shape
    fault, none = _fault(points.reshape(T, 1, C), times, after, b.shape[2]), np.zeros(4)
    if fault != 0:
        return fault
    for t in range(T):
        frame = t if len(b) > 1 else 0
        for p in range(P):
            turn = quat[frame, p] if b.shape[2] < C else none
            point_to_local(A[frame, p], b[frame, p], turn, points[t], out[t, p])
    return 0


@kernel
def _made_unit(point, n_dims):
    """Normalise a quaternion whose length is nearly right; return whether it was."""
    square = 0.0
    for k in range(n_dims, point.size):
        square += point[k] * point[k]
    norm = np.sqrt(square)
    if abs(norm - 1.0) > UNIT_TOLERANCE:
        return False
    for k in range(n_dims, point.size):
        point[k] /= norm
    return True
