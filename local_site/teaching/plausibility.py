"""Plausibility of demonstrations, checked where they come in: the learner itself checks nothing.

Every recording passes here before it is learned, whoever made it. Its units must be those in which people
demonstrate, it must have no gap, and something must move; the rest at its beginning is cut, and its rate
becomes the page's. A recording that fails is refused under its own name.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from farhand.common.errors import InvalidDemonstration
from farhand.common.model.manifold import Manifold
from farhand.common.wire.motion_encoding import MAX_GAP_S
from farhand.local_site.learning.learner_settings import LearnerSettings
from farhand.local_site.teaching.demonstration import Demonstration

Array = NDArray[np.float64]

PERIOD_S, ARM_PERIOD_S = 0.02, 0.01
"""Strokes are resampled to this period, whatever the rate of the hand's events; poses to the arm's [s]."""
MOVED_PART = 0.1
"""Least movement of a demonstration as a share of lambda, or of the rotation worth that much.

On less the learner would divide by zero or learn noise.
"""
REST_PART, REST_S = 0.02, 0.5
"""Within this part of lambda of its beginning a motion rests; rests at the beginning are cut to so long [s]."""
_DURATION_S = (0.1, 300.0)
_LONGEST_PERIOD_S = 0.5
_LARGEST_M, _FARTHEST_M = 10.0, 20.0
_MOST_APART = 30.0
"""Largest ratio of size or duration between demonstrations of one skill."""
_TIME_UNITS = {
    "milliseconds": 1e-3,
    "microseconds": 1e-6,
    "nanoseconds": 1e-9,
    "minutes": 60.0,
    "hours": 3600.0,
}
_LENGTH_UNITS = {"millimetres": 1e-3, "centimetres": 1e-2, "inches": 0.0254}


def period_s(space: Manifold) -> float:
    """Return the sampling period at which demonstrations of a space are learned [s]."""
    return ARM_PERIOD_S if space.oriented else PERIOD_S


def check_units(motion: Demonstration) -> None:
    """Refuse times and lengths that nobody demonstrates in seconds and metres, and what is too short to be learned.

    Raises:
        InvalidDemonstration: Naming the field, and the unit that it looks like.
    """
    check_scale(motion)
    duration_s = float(motion.time_s[-1] - motion.time_s[0])
    if duration_s < _DURATION_S[0]:
        raise _duration(duration_s)


def check_scale(motion: Demonstration) -> None:
    """Refuse times and lengths that are too large for seconds and metres.

    Raises:
        InvalidDemonstration: Naming the field, and the unit that it looks like.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        duration_s = float(motion.time_s[-1] - motion.time_s[0])
        step_s = float(np.median(np.diff(motion.time_s)))
        extent_m = float(np.ptp(motion.position_m, axis=0).max())
        away_m = max(float(np.abs(motion.in_frame(p)).max()) for p in range(len(motion.frame_names)))
    if step_s > _LONGEST_PERIOD_S:
        expected = f"a sample every {_LONGEST_PERIOD_S:g} s or more often, got {step_s:g} s"
        raise _invalid("time_s", expected + _like(step_s, 1e-4, 0.2, _TIME_UNITS, "s"))
    if not duration_s <= _DURATION_S[1]:
        raise _duration(duration_s)
    if not extent_m <= _LARGEST_M:
        expected = f"a motion of at most {_LARGEST_M:g} m, got {extent_m:g} m"
        raise _invalid("position_m", expected + _like(extent_m, 0.02, 3.0, _LENGTH_UNITS, "m"))
    if not away_m <= _FARTHEST_M:
        expected = f"a motion within {_FARTHEST_M:g} m of the task frames, got {away_m:g} m"
        expected += _like(away_m, 0.02, 3.0, _LENGTH_UNITS, "m")
        raise _invalid("position_m, frame_origin_m", expected + "; both need metres")


def gap_of(time_s: Array) -> tuple[int, float, float] | None:
    """Return the sample before the longest gap in a motion, its length and what is tolerated [s]; None without one."""
    steps_s = np.diff(time_s)
    most_s = max(MAX_GAP_S, 3.0 * float(np.median(steps_s)))
    worst = int(np.argmax(steps_s))
    return (worst, float(steps_s[worst]), most_s) if steps_s[worst] > most_s + 1e-3 else None


def check_together(motions: Sequence[Demonstration], names: Sequence[str]) -> None:
    """Refuse a motion whose size or duration differs so much from the others' that its unit must be another.

    Raises:
        InvalidDemonstration: Naming it.
    """
    extents_m = [float(np.ptp(motion.in_frame(), axis=0).max()) for motion in motions]
    durations_s = [float(motion.time_s[-1] - motion.time_s[0]) for motion in motions]
    for field, unit, sizes in (("position_m", "m", extents_m), ("time_s", "s", durations_s)):
        usual = float(np.median([size for size in sizes if size > 0.0] or [1.0]))
        for name, size in zip(names, sizes, strict=True):
            # A motion that does not move at all is refused elsewhere, with a better reason.
            if size > 0.0 and not 1.0 / _MOST_APART <= size / usual <= _MOST_APART:
                expected = (
                    f"about the {usual:g} {unit} of the others, got {size:g} {unit}: is its unit another?"
                )
                raise InvalidDemonstration(name, field, expected)


def check_moves(motion: Demonstration, settings: LearnerSettings) -> None:
    """Refuse a demonstration without movement: a click, a forgotten End, or less than the model's resolution.

    Raises:
        InvalidDemonstration: Giving the movement and the least movement required.
    """
    lambda_m, radian_m = settings.max_distance_m, metres_per_radian(settings)
    moved_m, turned_rad = _travel(motion)
    if max(moved_m, turned_rad * radian_m) < MOVED_PART * lambda_m:
        least = f"{MOVED_PART * lambda_m * 1e3:.3g} mm"
        got = f"{round(moved_m * 1e3, 2):g} mm"
        if motion.space.oriented:
            least += f" or {np.degrees(MOVED_PART * lambda_m / radian_m):.3g} degrees"
            got += f" and {round(float(np.degrees(turned_rad)), 2):g} degrees"
        expected = (
            f"a motion of at least {least} ({MOVED_PART:g} of lambda, {lambda_m:g} m), got {got}: "
            "show the whole motion, or choose a smaller lambda"
        )
        raise _invalid("position_m, quat_wxyz" if motion.space.oriented else "position_m", expected)


def prepared(motion: Demonstration, settings: LearnerSettings) -> Demonstration:
    """Return a recording as it is learned: without the rest at its beginning, at the page's rate.

    Raises:
        InvalidDemonstration: When its units are implausible or it has a gap; naming the samples.
    """
    check_units(motion)
    _check_gaps(motion)
    return _resampled(_without_rest(motion, settings), period_s(motion.space))


def extent_m(motions: Sequence[Demonstration]) -> float:
    """Return the largest edge of the box around all motions, seen from the goal [m]."""
    return float(np.ptp(np.concatenate([motion.in_frame() for motion in motions]), axis=0).max())


def turns(motions: Sequence[Demonstration]) -> bool:
    """Decide whether one of the motions rotates far enough to be learned for its rotation."""
    return any(_travel(motion)[1] >= MOVED_PART for motion in motions if motion.space.oriented)


def metres_per_radian(settings: LearnerSettings) -> float:
    """Return the weight of a radian in the learner's distances [m/rad]."""
    return settings.rotation_weight * settings.max_distance_m


def _travel(motion: Demonstration) -> tuple[float, float]:
    """Return the largest distance and rotation from the start [m, rad].

    A distance counts as far as both the world and at least one task frame see it.
    """
    seen_m = [_from_start(motion.in_frame(p)) for p in range(len(motion.frame_names))]
    moved_m = min(_from_start(motion.position_m), max(seen_m))
    if not motion.space.oriented:
        return moved_m, 0.0
    turns = motion.space.log(motion.points[:1], motion.points)[:, motion.n_dims :]
    return moved_m, float(np.linalg.norm(turns, axis=1).max())


def _from_start(points: Array) -> float:
    with np.errstate(over="ignore"):
        return float(np.linalg.norm(points - points[0], axis=1).max())


def _check_gaps(motion: Demonstration) -> None:
    found = gap_of(motion.time_s)
    if found is not None:
        worst, gap_s, most_s = found
        at_s = motion.time_s[worst] - motion.time_s[0]
        raise _invalid(
            "time_s",
            f"no gap of more than {most_s:g} s, but nothing was recorded for {gap_s:g} s after sample "
            f"{worst} (at {at_s:g} s): cut the recording there, or record the motion again",
        )


def _duration(duration_s: float) -> InvalidDemonstration:
    least_s, most_s = _DURATION_S
    expected = f"a motion of {least_s:g} to {most_s:g} s, got {duration_s:g} s"
    return _invalid("time_s", expected + _like(duration_s, 0.5, 120.0, _TIME_UNITS, "s"))


def _without_rest(motion: Demonstration, settings: LearnerSettings) -> Demonstration:
    distances_m = motion.space.distance(motion.points[:1], motion.points, metres_per_radian(settings))
    gone = np.flatnonzero(distances_m > REST_PART * settings.max_distance_m)
    if not gone.size:
        return motion
    first = int(np.searchsorted(motion.time_s, motion.time_s[gone[0]] - REST_S - 1e-9))
    return motion if first == 0 else motion.samples(slice(first, None))


def _resampled(motion: Demonstration, period_s: float) -> Demonstration:
    """Return the motion at regular times from its first to its last sample, linear between two samples."""
    steps_s = np.diff(motion.time_s)
    if np.abs(steps_s - period_s).max() <= 1e-3 * period_s:
        return motion
    begin_s, end_s = motion.time_s[0], motion.time_s[-1]
    times_s = np.linspace(begin_s, end_s, max(2, round((end_s - begin_s) / period_s) + 1))
    before = np.clip(np.searchsorted(motion.time_s, times_s, side="right") - 1, 0, motion.time_s.size - 2)
    part = ((times_s - motion.time_s[before]) / steps_s[before])[:, None]
    space, points, origin, quat = motion.space, motion.points, motion.frame_origin_m, motion.quat_wxyz
    points = space.exp(points[before], part * space.log(points[before], points[before + 1]))
    if origin.ndim == 3:
        origin = origin[before] + part[:, None] * (origin[before + 1] - origin[before])
    if quat is not None:
        quat = points[:, motion.n_dims :] if space.oriented else quat[before]
    moving = motion.frame_rotation.ndim == 4
    return replace(
        motion,
        time_s=times_s,
        position_m=points[:, : motion.n_dims],
        quat_wxyz=quat,
        frame_origin_m=origin,
        frame_rotation=_turned_at(motion, times_s) if moving else motion.frame_rotation,
    )


def _turned_at(motion: Demonstration, times_s: Array) -> Array:
    """Return the orientations of turning task frames at other times. Shape (n, P, D, D)."""
    A = motion.frame_rotation
    if motion.n_dims == 2:
        angles = np.unwrap(np.arctan2(A[..., 1, 0], A[..., 0, 0]), axis=0)
        turns = np.stack([np.interp(times_s, motion.time_s, column) for column in angles.T], axis=1)
        c, s = np.cos(turns), np.sin(turns)
        return np.stack([np.stack([c, -s], -1), np.stack([s, c], -1)], -2)
    from scipy.spatial.transform import Rotation, Slerp  # slow to import, and few recordings need it

    frames = [Slerp(motion.time_s, Rotation.from_matrix(A[:, p]))(times_s) for p in range(A.shape[1])]
    return np.stack([frame.as_matrix() for frame in frames], axis=1)


def _like(value: float, least: float, most: float, units: dict[str, float], unit: str) -> str:
    """Name the units in which a number would be plausible."""
    likely = [f"{name} ({value * f:g} {unit})" for name, f in units.items() if least <= value * f <= most]
    return f"; it looks like {' or '.join(likely)}" if likely else ""


def _invalid(field: str, expected: str) -> InvalidDemonstration:
    return InvalidDemonstration("demonstration", field, expected)
