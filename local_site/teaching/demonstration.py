"""Demonstration: one motion with its task frames, and the `.npz` file that holds it.

A file has the arrays ``schema`` (int; 1 when it is missing), ``time_s`` (T,), ``position_m`` (T, 2|3), ``frame_origin_m``
(P, D) or (T, P, D), ``frame_rotation`` (P, D, D) or (T, P, D, D), ``frame_names`` (P,), and may have
``quat_wxyz`` (T, 4) and ``source``, where the recording came from. Nothing in it is ever unpickled.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from io import BytesIO
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from farhand.common.errors import InvalidDemonstration
from farhand.common.model.manifold import Manifold
from farhand.common.model.task_frame import TaskFrame
from farhand.common.whole_file import fault_of, read_whole, write_whole
from farhand.local_site.teaching.plain_arrays import arrays_of

Array = NDArray[np.float64]

SCHEMA_VERSION = 1

_REQUIRED = {"time_s", "position_m", "frame_origin_m", "frame_rotation", "frame_names"}
_OPTIONAL = {"schema", "quat_wxyz", "source"}
_UNIT_TOLERANCE = 1e-3


@dataclass(frozen=True, eq=False, kw_only=True)
class Demonstration:
    """Motion in the world with the task frames during it.

    Args:
        time_s: Increasing times [s]. Shape (T,), at least two.
        position_m: Positions in the world [m]. Shape (T, D), D = 2 or 3.
        frame_origin_m: Origins of the task frames [m]. Shape (P, D), or (T, P, D) when they move.
        frame_rotation: Orientations of the task frames. Shape (P, D, D), or (T, P, D, D).
        frame_names: One name per frame; the last one is the goal's. Length P.
        quat_wxyz: Orientations, unit quaternions. Shape (T, 4).
        source: Origin of the recording.

    Raises:
        InvalidDemonstration: Naming the field at fault.
    """

    time_s: Array
    position_m: Array
    frame_origin_m: Array
    frame_rotation: Array
    frame_names: tuple[str, ...]
    quat_wxyz: Array | None = None
    source: str = ""

    def __post_init__(self) -> None:
        for name in ("time_s", "position_m", "frame_origin_m", "frame_rotation", "quat_wxyz"):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, _real(name, value))
        object.__setattr__(self, "frame_names", tuple(str(name) for name in self.frame_names))
        with np.errstate(all="ignore"):  # numbers that overflow are refused by the check below
            self._check_motion()
            self._check_frames()

    def _check_motion(self) -> None:
        T = self.time_s.size
        if self.time_s.ndim != 1 or T < 2:
            raise _invalid("time_s", f"shape (T,) with T >= 2, got {self.time_s.shape}")
        late = np.flatnonzero(~(np.diff(self.time_s) > 0))
        if late.size:
            k = int(late[0]) + 1
            between = f"{self.time_s[k]:g} s after {self.time_s[k - 1]:g} s"
            raise _invalid("time_s", f"times that increase, but sample {k} of 0 to {T - 1} is at {between}")
        if self.position_m.ndim != 2 or self.position_m.shape[0] != T or self.n_dims not in (2, 3):
            raise _invalid("position_m", f"shape ({T}, 2) or ({T}, 3), got {self.position_m.shape}")
        if self.quat_wxyz is not None:
            if self.quat_wxyz.shape != (T, 4):
                raise _invalid("quat_wxyz", f"shape ({T}, 4), got {self.quat_wxyz.shape}")
            if np.abs(np.linalg.norm(self.quat_wxyz, axis=1) - 1.0).max() > _UNIT_TOLERANCE:
                raise _invalid("quat_wxyz", "unit quaternions")

    def _check_frames(self) -> None:
        T, D, P = self.time_s.size, self.n_dims, len(self.frame_names)
        if P == 0 or len(set(self.frame_names)) != P or "" in self.frame_names:
            raise _invalid("frame_names", f"one name or more, all different, got {self.frame_names!r}")
        for name, tail in (("frame_origin_m", (P, D)), ("frame_rotation", (P, D, D))):
            shape = getattr(self, name).shape
            if shape not in (tail, (T, *tail)):
                raise _invalid(name, f"shape {tail} or {(T, *tail)}, got {shape}")
        turned = self.frame_rotation @ np.swapaxes(self.frame_rotation, -1, -2)
        if not np.abs(turned - np.eye(D)).max() <= 1e-6:
            raise _invalid("frame_rotation", "orthonormal matrices (A A^T = I)")
        if (np.linalg.det(self.frame_rotation) < 0).any():
            expected = "rotations (det A = 1), got a mirror image: is an axis of the frame reversed?"
            raise _invalid("frame_rotation", expected)

    @property
    def n_dims(self) -> int:
        """Dimension D of the space."""
        return self.position_m.shape[1]

    @property
    def space(self) -> Manifold:
        """Space of the motion: poses if there are orientations in space, else positions."""
        return Manifold(self.n_dims, oriented=self.quat_wxyz is not None and self.n_dims == 3)

    @property
    def points(self) -> Array:
        """Points of the motion: positions (T, D), or poses (T, 7)."""
        if self.quat_wxyz is None or not self.space.oriented:
            return self.position_m
        return np.hstack([self.position_m, self.quat_wxyz])

    @property
    def frames_move(self) -> bool:
        """True if the task frames are given for every sample."""
        return self.frame_origin_m.ndim == 3 or self.frame_rotation.ndim == 4

    def frames_at(self, sample: int) -> list[TaskFrame]:
        """Return the task frames at one sample. Length P."""
        b = self.frame_origin_m[sample] if self.frame_origin_m.ndim == 3 else self.frame_origin_m
        A = self.frame_rotation[sample] if self.frame_rotation.ndim == 4 else self.frame_rotation
        return [TaskFrame(a, o) for a, o in zip(A, b, strict=True)]

    def frames(self) -> list[TaskFrame] | list[list[TaskFrame]]:
        """Return the task frames for a learner: P of them, or P for every sample if they move."""
        return [self.frames_at(t) for t in range(self.time_s.size)] if self.frames_move else self.frames_at(0)

    def in_frame(self, frame: int = -1) -> Array:
        """Return the motion in one of the task frames, by default the goal's (Eq. 1) [m]. Shape (T, D)."""
        if not self.frames_move:
            return self.frames_at(0)[frame].to_local(self.position_m)
        b = self.frame_origin_m[..., frame, :]
        A = np.broadcast_to(self.frame_rotation[..., frame, :, :], (len(b), self.n_dims, self.n_dims))
        return np.einsum("tki,tk->ti", A, self.position_m - b)

    def same_motion(self, other: Demonstration) -> bool:
        """Decide whether another demonstration is the very same motion in the same frames."""
        pairs = (
            (self.time_s, other.time_s), (self.points, other.points),
            (self.frame_origin_m, other.frame_origin_m), (self.frame_rotation, other.frame_rotation),
        )  # fmt: skip
        return all(np.array_equal(mine, its) for mine, its in pairs)

    def thinned(self, every: int) -> Demonstration:
        """Return every n-th sample, and always the last one: where a demonstration ends matters most."""
        keep = np.arange(0, self.time_s.size, every)
        if keep[-1] != self.time_s.size - 1:
            keep = np.append(keep, self.time_s.size - 1)
        return self.samples(keep)

    def samples(self, keep: slice | NDArray[np.int64]) -> Demonstration:
        """Return the motion with a selection of its samples."""
        origin, rotation = self.frame_origin_m, self.frame_rotation
        return replace(
            self,
            time_s=self.time_s[keep],
            position_m=self.position_m[keep],
            frame_origin_m=origin[keep] if origin.ndim == 3 else origin,
            frame_rotation=rotation[keep] if rotation.ndim == 4 else rotation,
            quat_wxyz=None if self.quat_wxyz is None else self.quat_wxyz[keep],
        )

    @classmethod
    def within(
        cls, frames: Sequence[TaskFrame], names: Sequence[str], time_s: ArrayLike, points: Array
    ) -> Demonstration:
        """Return a motion within task frames that stand still.

        Args:
            frames: Task frames. Length P.
            names: Names of the frames. Length P.
            time_s: Increasing times. Shape (T,) [s].
            points: Positions (T, D) [m], or poses (T, 7).

        Raises:
            InvalidDemonstration: Naming the field at fault.
        """
        D = frames[0].n_dims
        return cls(
            time_s=np.asarray(time_s, dtype=float),
            position_m=points[:, :D],
            quat_wxyz=points[:, D:] if points.shape[1] > D else None,
            frame_origin_m=np.stack([frame.b for frame in frames]),
            frame_rotation=np.stack([frame.A for frame in frames]),
            frame_names=tuple(names),
        )

    def save(self, path: Path | str) -> None:
        """Write the file, whole or not at all."""
        write_whole(path, self.encode())

    def encode(self) -> bytes:
        """Return the bytes of the file, without pickle."""
        arrays: dict[str, ArrayLike] = {
            "schema": np.int64(SCHEMA_VERSION),
            "time_s": self.time_s,
            "position_m": self.position_m,
            "frame_origin_m": self.frame_origin_m,
            "frame_rotation": self.frame_rotation,
            "frame_names": np.array(self.frame_names, dtype=np.str_),
        }
        if self.quat_wxyz is not None:
            arrays["quat_wxyz"] = self.quat_wxyz
        if self.source:
            arrays["source"] = np.array(self.source, dtype=np.str_)
        stream = BytesIO()
        np.savez_compressed(stream, allow_pickle=False, **arrays)
        return stream.getvalue()

    @classmethod
    def load(cls, path: Path | str) -> Demonstration:
        """Read a file.

        Raises:
            InvalidDemonstration: Naming the file, the field and what was expected.
        """
        with fault_of(path, InvalidDemonstration, "a demonstration"):
            return cls.decode(read_whole(path), path)

    @classmethod
    def decode(cls, content: bytes, source: Path | str) -> Demonstration:
        """Return the demonstration in the bytes of a file of this name; errors as `load`."""
        with fault_of(source, InvalidDemonstration, "a whole .npz file of plain arrays"):
            return cls(**_fields(arrays_of(content)))


def _fields(arrays: dict[str, NDArray]) -> dict:
    """Return the constructor's arguments from a file's arrays."""
    for name in sorted(_REQUIRED - arrays.keys()):
        raise _invalid(name, "a field that is missing here")
    for name in sorted(arrays.keys() - _REQUIRED - _OPTIONAL):
        raise _invalid(name, "no such field in a demonstration")
    schema, names = arrays.pop("schema", np.array(SCHEMA_VERSION)), arrays.pop("frame_names")
    if schema.shape != () or schema.dtype.kind not in "iu" or int(schema) != SCHEMA_VERSION:
        raise _invalid("schema", f"version {SCHEMA_VERSION}, got {schema!r}")
    if names.ndim != 1 or names.dtype.kind != "U":
        raise _invalid("frame_names", f"text of shape (P,), got {names.dtype} of shape {names.shape}")
    source = arrays.pop("source", np.array(""))
    if source.shape != () or source.dtype.kind != "U":
        raise _invalid("source", "one text")
    return {**arrays, "frame_names": tuple(names.tolist()), "source": str(source)}


def _real(name: str, value: ArrayLike) -> Array:
    array = np.asarray(value)
    if array.dtype.kind not in "fiu":
        raise _invalid(name, f"real numbers, got {array.dtype}")
    array = np.array(array, dtype=float)
    if not np.isfinite(array).all():
        first = np.argwhere(~np.isfinite(array))[0].tolist()
        raise _invalid(name, f"finite numbers only, got {array[tuple(first)]} at {first}")
    array.setflags(write=False)
    return array


def _invalid(field: str, expected: str) -> InvalidDemonstration:
    return InvalidDemonstration("demonstration", field, expected)
