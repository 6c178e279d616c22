"""Encodings of motions: those that the robot recorded, and the points of a planned path.

Row for row: time since the first sample [s], the point (C,), and for each task frame its origin (D,) with its
orientation: one angle in the plane, a unit quaternion in space.

A pose has seven numbers, and a narrow link carries a few hundred bytes a second. Half precision gives 1 mm
and 0.1 degrees within 2 m of the task frame, which suffices for drawing and viewing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, NamedTuple

import msgpack
import msgspec
import numpy as np
from msgspec import Meta, Struct, structs
from numpy.typing import ArrayLike, NDArray

from farhand.common.errors import InvalidMessage
from farhand.common.model.manifold import POSE, Manifold
from farhand.common.model.task_frame import TaskFrame
from farhand.common.whole_file import fault_of
from farhand.common.wire.messages import Id, PlannedPath, Stamp

Array = NDArray[np.float64]

MAX_DURATION_S = 120.0
"""Longest recording [s]."""
MAX_GAP_S = 0.1
"""Longest gap between two samples; a motion with a longer one is refused [s]."""


class Samples(NamedTuple):
    """Recorded samples, T of them.

    Args:
        time_s: Times since the first sample [s]. Shape (T,).
        points: Positions [m] or poses. Shape (T, C).
        frame_origin_m: Origins of the task frames as perceived by the robot [m]. Shape (T, P, D).
        frame_rotation: Orientations of the task frames. Shape (T, P, D, D).
    """

    time_s: Array
    points: Array
    frame_origin_m: Array
    frame_rotation: Array


class RecordedMotion(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """One motion in world coordinates of the robot, as sent."""

    task: Id
    frame_names: Annotated[tuple[Id, ...], Meta(min_length=1, max_length=8)]
    n_dims: Annotated[int, Meta(ge=2, le=3)]
    oriented: bool
    began: Stamp
    """Time of the first sample on the robot's clock."""
    rows: bytes
    """Little-endian single precision, shape (T, n)."""

    @classmethod
    def from_bytes(cls, data: bytes) -> RecordedMotion:
        """Decode a motion from bytes.

        Raises:
            InvalidMessage: When they are something else.
        """
        with fault_of("recorded motion", InvalidMessage, "MessagePack"):
            motion = msgspec.convert(msgpack.unpackb(data), cls, builtin_types=(bytes,))
            _ = motion.space
            return motion

    @property
    def content(self) -> bytes:
        """Bytes of the motion."""
        return msgpack.Packer().pack(msgspec.to_builtins(self, builtin_types=(bytes,)))

    @property
    def space(self) -> Manifold:
        """Space of the points."""
        return Manifold(self.n_dims, oriented=self.oriented)

    def samples(self) -> Samples:
        """Return all samples.

        Raises:
            InvalidMessage: When a row is not whole, a number not finite, or there is a gap.
        """
        n_coordinates, n_frames = self.space.n_coordinates, len(self.frame_names)
        width = 1 + n_coordinates + n_frames * _frame_width(self.n_dims)
        if not self.rows or len(self.rows) % (4 * width):
            raise _invalid(f"whole rows of {width} numbers, one or more")
        with np.errstate(invalid="ignore"):  # signalling NaNs, which are refused below
            table = np.frombuffer(self.rows, "<f4").reshape(-1, width).astype(np.float64)
        if not np.isfinite(table).all():
            raise _invalid("finite numbers only")
        steps_s = np.diff(table[:, 0])
        if (steps_s <= 0.0).any() or (steps_s > MAX_GAP_S + 1e-3).any():
            raise _invalid(f"times that increase by at most {MAX_GAP_S:g} s")
        frames = table[:, 1 + n_coordinates :].reshape(len(table), n_frames, -1)
        points = table[:, 1 : 1 + n_coordinates].copy()
        points[:, self.n_dims :] = _unit(points[:, self.n_dims :])
        return Samples(
            table[:, 0], points, frames[..., : self.n_dims], _rotations(frames[..., self.n_dims :])
        )


def packed_row(time_s: float, point: Array, frames: Sequence[TaskFrame]) -> bytes:
    """Pack one sample as a row of `RecordedMotion.rows`.

    Args:
        time_s: Time since the first sample [s].
        point: Position or pose. Shape (C,).
        frames: Task frames as perceived then. Length P.
    """
    numbers = [np.array([time_s]), point]
    for frame in frames:
        turn = frame.quat_wxyz if frame.n_dims == 3 else [math.atan2(frame.A[1, 0], frame.A[0, 0])]
        numbers += [frame.b, turn]
    return np.concatenate(numbers).astype("<f4").tobytes()


def _frame_width(n_dims: int) -> int:
    return n_dims + (4 if n_dims == 3 else 1)


def _unit(quaternions: Array) -> Array:
    """Normalise quaternions of shape (..., 4), or (..., 0) without any."""
    lengths = np.linalg.norm(quaternions, axis=-1, keepdims=True)
    if quaternions.shape[-1] and not (np.abs(lengths - 1.0) < 1e-3).all():
        raise _invalid("unit quaternions")
    return quaternions / lengths if quaternions.shape[-1] else quaternions


def _rotations(turns: Array) -> Array:
    """Return the rotation matrices (..., D, D) of angles (..., 1) or of quaternions (..., 4)."""
    if turns.shape[-1] == 1:
        c, s = np.cos(turns[..., 0]), np.sin(turns[..., 0])
        return np.stack([np.stack([c, -s], -1), np.stack([s, c], -1)], -2)
    w, x, y, z = np.moveaxis(_unit(turns), -1, 0)
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    return np.stack([np.stack(row, -1) for row in rows], -2)


def _invalid(expected: str) -> InvalidMessage:
    return InvalidMessage("recorded motion", "rows", expected)


def packed(points: ArrayLike) -> bytes:
    """Encode points of shape (N, C) as bytes."""
    points = np.asarray(points, dtype=float)
    return points.astype(_dtype(points.shape[1])).tobytes()


def points_of(path: PlannedPath) -> Array:
    """Return the points of a path in the task frame; quaternions of unit length. Shape (N, C).

    Raises:
        InvalidMessage: When the bytes are not a whole number of points.
    """
    dtype = _dtype(path.n_coordinates)
    if len(path.points) % (dtype.itemsize * path.n_coordinates):
        raise InvalidMessage("path", "points", f"whole points of {path.n_coordinates} numbers")
    points = np.frombuffer(path.points, dtype).reshape(-1, path.n_coordinates).astype(float)
    if path.n_coordinates == POSE.n_coordinates:
        points[:, 3:] /= np.linalg.norm(points[:, 3:], axis=1, keepdims=True)
    return points


def thinned(path: PlannedPath, max_bytes: int) -> PlannedPath:
    """Lengthen the steps of a path until its points fit into a number of bytes.

    The last point stays the last, at the end of a whole step: up to a step later than before.

    Args:
        path: Path in steps that are short enough to draw.
        max_bytes: Size for two points or more.
    """
    size = path.n_coordinates * _dtype(path.n_coordinates).itemsize
    n = len(path.points) // size
    if len(path.points) <= max_bytes:
        return path
    every = -(-(n - 1) // (max_bytes // size - 1))
    kept = [*range(0, n - 1, every), n - 1]
    points = b"".join(path.points[k * size : (k + 1) * size] for k in kept)
    return structs.replace(path, step_s=every * path.step_s, points=points)


def duration_s(path: PlannedPath) -> float:
    """Return the time from the first point to the last [s]."""
    n = len(path.points) // (_dtype(path.n_coordinates).itemsize * path.n_coordinates)
    return max(n - 1, 0) * path.step_s


def _dtype(n_coordinates: int) -> np.dtype:
    return np.dtype("<f2" if n_coordinates == POSE.n_coordinates else "<f4")
