"""Frames: a body within others (TF), the tip of a tool on a body, and the task frames of a motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from farhand.common.errors import InvalidDemonstration
from farhand.local_site.recordings.options import FrameChoice
from farhand.local_site.recordings.tracks import FRAME_GAP_S, Track

Array = NDArray[np.float64]

_IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])


def in_root(name: str, tracks: Mapping[str, Track], below: tuple[str, ...] = ()) -> Track:
    """Return the track of a body in the outermost frame that its parents lead to.

    Raises:
        InvalidDemonstration: When the parents form a circle, or were not recorded at the same time as the body.
    """
    track = tracks[name]
    if name in below:
        raise _invalid(name, f"frames that lead outwards, got the circle {' in '.join((*below, name))}")
    if track.parent not in tracks or track.parent == name:
        return track
    above = in_root(track.parent, tracks, (*below, name))
    if track.fixed:
        time_s, rows = above.time_s, above.rows
    elif above.fixed:
        time_s, rows = track.time_s, track.rows
    else:
        both = (track.time_s >= above.time_s[0] - FRAME_GAP_S) & (
            track.time_s <= above.time_s[-1] + FRAME_GAP_S
        )
        time_s, rows = track.time_s[both], track.rows[both]
        if len(time_s) < 2:
            raise _invalid(name, f"{track.parent} to be recorded at the same time, got none")
    outer, inner = above.at(time_s), track.at(time_s)
    position, quat = composed(outer, inner.position_m, inner.quat_wxyz)
    further = next((words for subject, words in above.told if subject == "within"), above.parent)
    told = (*track.told, ("within", f"{track.parent} in {further}"))
    return Track(name, time_s, position, quat, rows, track.row, above.parent, told)


def composed(outer: Track, position_m: Array, quat_wxyz: Array | None) -> tuple[Array, Array | None]:
    """Convert poses relative to a moving body into poses relative to the body's parent frame.

    Args:
        outer: Track of the body, with T samples.
        position_m: Positions relative to the body [m]. Shape (T, 3) or (3,).
        quat_wxyz: Orientations relative to the body. Shape (T, 4) or (4,).
    """
    turn = np.broadcast_to(_IDENTITY, (len(outer.time_s), 4)) if outer.quat_wxyz is None else outer.quat_wxyz
    position = outer.position_m + np.einsum(
        "tij,tj->ti", matrices(turn), np.broadcast_to(position_m, outer.position_m.shape)
    )
    if quat_wxyz is None:
        return position, None
    w, v = turn[:, :1], turn[:, 1:]
    inner = np.broadcast_to(quat_wxyz, turn.shape)
    iw, iv = inner[:, :1], inner[:, 1:]
    scalar = w * iw - np.sum(v * iv, axis=1, keepdims=True)
    return position, np.hstack([scalar, w * iv + iw * v + np.cross(v, iv)])


def matrices(quat_wxyz: Array) -> Array:
    """Return rotation matrices of unit quaternions. Shapes (T, 4), (T, 3, 3)."""
    from scipy.spatial.transform import Rotation  # takes long to import

    return Rotation.from_quat(quat_wxyz, scalar_first=True).as_matrix()


def with_tool(track: Track, tool: tuple[float, ...]) -> Track:
    """Return the track of the tool's tip instead of that of the body that carries it."""
    if not tool:
        return track
    if track.quat_wxyz is None:
        raise _invalid("--tool", "a tracked body with orientations, which this one has not")
    axes = np.array(tool[3:]) / np.linalg.norm(tool[3:]) if len(tool) == 7 else np.array([1.0, 0.0, 0.0, 0.0])
    position, quat = composed(track, np.array(tool[:3]), axes)
    told = (*track.told, ("tool", f"the tip at {vector(tool[:3])} m in the axes of the body"))
    return replace(track, position_m=position, quat_wxyz=quat, told=told)


FrameTrack = tuple[Array, Array, str]
"""Origins (T, D) or (1, D), orientations (T, D, D) or (1, D, D), and their source in words."""


def frame_of(choice: FrameChoice, motion: Track, tracks: Mapping[str, Track]) -> FrameTrack:
    """Return one task frame during a motion.

    Raises:
        InvalidDemonstration: When the recording lacks the frame, or has it in another frame or dimension than the motion.
    """
    D = motion.position_m.shape[1]
    if choice.numbers:
        return _given(choice, D)
    if choice.source == "last":
        return (
            motion.position_m[-1:],
            np.eye(D)[None],
            f"where the motion ends, {vector(motion.position_m[-1])} m, axes of the world",
        )
    if choice.source == "last-pose":
        if motion.quat_wxyz is None:
            raise _invalid("--frames", f"{choice.name}=last: the motion has no orientations for last-pose")
        where = f"where the motion ends, {vector(motion.position_m[-1])} m, and as it is turned there"
        return motion.position_m[-1:], matrices(motion.quat_wxyz[-1:])[:, :D, :D], where
    if choice.source not in tracks:
        raise _invalid(
            "--frames",
            f"{choice.name}=last, last-pose, X,Y,Z or the name of a body in the recording, got {choice.source!r}",
        )
    track = in_root(choice.source, tracks)
    if track.parent != motion.parent:
        expected = (
            f"{choice.source} in the frame of the motion, {motion.parent!r}, but it is in {track.parent!r}: "
            "record the transforms between them (TF), or give the frame by hand"
        )
        raise _invalid("--frames", expected)
    if track.position_m.shape[1] != D:
        raise _invalid(
            "--frames", f"{choice.source} in {D} dimensions as the motion, got {track.position_m.shape[1]}"
        )
    track = track.at(motion.time_s)
    quat = track.quat_wxyz
    A = np.eye(D)[None] if quat is None else matrices(quat)[:, :D, :D]
    moved_m = float(np.ptp(track.position_m, axis=0).max())
    fixed = moved_m == 0.0 and (quat is None or not np.ptp(quat, axis=0).any())
    turned = "axes of the world" if quat is None else "with its axes"
    where = f"body {choice.source}, {turned}, " + (
        "stands still" if fixed else f"moves by {moved_m * 1e3:.1f} mm"
    )
    return (track.position_m[:1], A[:1], where) if fixed else (track.position_m, A, where)


def _given(choice: FrameChoice, D: int) -> FrameTrack:
    numbers = choice.numbers
    if (D == 2 and len(numbers) == 7) or (D == 3 and len(numbers) == 2):
        raise _invalid(
            "--frames", f"{choice.name} in {D} dimensions as the motion, got {len(numbers)} numbers"
        )
    A = np.eye(D)
    if D == 2 and len(numbers) == 3:
        c, s = np.cos(numbers[2]), np.sin(numbers[2])
        A = np.array([[c, -s], [s, c]])
    elif len(numbers) == 7:
        A = matrices(np.array([numbers[3:]]))[0]
    return np.array([numbers[:D]]), A[None], f"given by hand, {vector(numbers[:D])} m"


def vector(numbers: Sequence[float] | Array) -> str:
    """Return numbers as a text."""
    return "(" + ", ".join(f"{number:.3f}" for number in numbers) + ")"


def _invalid(field: str, expected: str) -> InvalidDemonstration:
    return InvalidDemonstration("recording", field, expected)
