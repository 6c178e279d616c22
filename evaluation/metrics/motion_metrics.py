"""Measures of one motion and of two: smoothness, orientation errors, dynamic time warping."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from farhand.common.model.kernel import kernel
from farhand.local_site.teaching.demonstration import Demonstration

Array = NDArray[np.float64]

# Over how much of its way the approach is judged [m].
APPROACH_M = 0.05
# What counts as a success.
MAX_END_M, MAX_LATERAL_M, MAX_ANGLE_DEG = 0.003, 0.005, 5.0

_N_PHASES = 200


class Approach(NamedTuple):
    """Errors of a motion's approach to a receptacle."""

    end_m: float  # distance of its last point from the mouth
    angle_deg: float  # between its last 5 cm and the axis
    lateral_m: float  # largest distance from the axis within these

    @property
    def success(self) -> bool:
        """True when all three errors are within their tolerances."""
        return self.end_m <= MAX_END_M and self.lateral_m <= MAX_LATERAL_M and self.angle_deg <= MAX_ANGLE_DEG


def approach_of(local: Array) -> Approach:
    """Judge a motion by its last 5 cm: from where it last came that close to its own end.

    Args:
        local: Positions in the receptacle's frame, whose axis is z [m]. Shape (T, 3).
    """
    way = local[-1] - local
    outside = np.flatnonzero(np.linalg.norm(way, axis=1) >= APPROACH_M)
    first = int(outside[-1]) if outside.size else 0
    chord = way[first]
    length = float(np.linalg.norm(chord))
    angle_deg = float(np.degrees(np.arccos(np.clip(-chord[2] / length, -1.0, 1.0)))) if length > 0 else 180.0
    lateral_m = float(np.linalg.norm(local[first:, :2], axis=1).max())
    return Approach(float(np.linalg.norm(local[-1])), angle_deg, lateral_m)


def at_phases(time_s: Array, position: Array, n_phases: int = _N_PHASES) -> Array:
    """Resample a motion at equal fractions of its duration. Shape (n_phases, D)."""
    phase = (time_s - time_s[0]) / (time_s[-1] - time_s[0])
    at = np.linspace(0.0, 1.0, n_phases)
    return np.stack([np.interp(at, phase, axis) for axis in position.T], axis=1)


def rms(difference: Array) -> float:
    """Return the root mean square of the length of vectors. Shape (T, D)."""
    return float(np.sqrt(np.mean(np.sum(difference**2, axis=-1))))


def time_rms(time_a: Array, a: Array, time_b: Array, b: Array) -> float:
    """Return the root mean square distance of two motions at equal fractions of their durations [m]."""
    return rms(at_phases(time_a, a) - at_phases(time_b, b))


def arc_rms(a: Array, b: Array, n_points: int = 100) -> float:
    """Return the root mean square distance of two motions at equal fractions of their lengths [m]."""
    return rms(resampled_by_length(a, n_points) - resampled_by_length(b, n_points))


def end_direction_deg(a: Array, b: Array, n_points: int = 100) -> float:
    """Return the angle between the directions in which two motions cover the last tenth of their lengths."""
    last = n_points // 10
    chords = [path[-1] - path[-1 - last] for path in (resampled_by_length(one, n_points) for one in (a, b))]
    lengths = [float(np.linalg.norm(c)) for c in chords]
    if min(lengths) == 0.0:
        return 180.0
    return float(np.degrees(np.arccos(np.clip(chords[0] @ chords[1] / np.prod(lengths), -1.0, 1.0))))


def spectral_arc_length(
    time_s: Array, position: Array, cutoff_hz: float = 10.0, threshold: float = 0.05
) -> float:
    """Return the smoothness of a motion: arc length of the normalised spectrum of its speed, negative.

    The nearer to zero the smoother; a minimum-jerk stroke has about -1.4, whatever its length and duration
    (SPARC, Balasubramanian et al. 2015).
    """
    rate_hz = 100.0
    at = np.arange(time_s[0], time_s[-1], 1.0 / rate_hz)
    points = np.stack([np.interp(at, time_s, axis) for axis in position.T], axis=1)
    speed = np.linalg.norm(np.diff(points, axis=0), axis=1) * rate_hz
    n = int(2 ** (np.ceil(np.log2(speed.size)) + 4))
    spectrum = np.abs(np.fft.rfft(speed, n))
    frequency = np.fft.rfftfreq(n, 1.0 / rate_hz)
    spectrum, frequency = spectrum[frequency <= cutoff_hz] / spectrum.max(), frequency[frequency <= cutoff_hz]
    last = int(np.flatnonzero(spectrum >= threshold)[-1])
    spectrum, frequency = spectrum[: last + 1], frequency[: last + 1]
    steps = np.hypot(np.diff(frequency) / (frequency[-1] - frequency[0]), np.diff(spectrum))
    return -float(steps.sum())


_N = 100


def turns_of(demonstration: Demonstration) -> Rotation:
    """Return 100 orientations seen from the goal at equal fractions of the length."""
    local = demonstration.frames_at(0)[-1].to_local(demonstration.points)
    steps = np.linalg.norm(np.diff(local[:, :3], axis=0), axis=1)
    travelled = np.concatenate([[0.0], np.cumsum(steps + 1e-12)])  # Slerp needs times that increase
    return Slerp(travelled, Rotation.from_quat(local[:, 3:], scalar_first=True))(
        np.linspace(0.0, travelled[-1], _N)
    )


def mean_turns(taught: Sequence[Rotation], start: Rotation) -> Rotation:
    """Compute the mean of the demonstrations' orientations, turned to the given start."""
    mean = Rotation.concatenate(
        [Rotation.concatenate([turns[n] for turns in taught]).mean() for n in range(_N)]
    )
    off = (mean[0].inv() * start).as_rotvec()
    return mean * Rotation.from_rotvec(np.linspace(1.0, 0.0, _N)[:, None] * off)


def turn_rms_deg(a: Rotation, b: Rotation) -> float:
    """Return the root mean square angle between orientations."""
    return float(np.degrees(np.sqrt(np.mean((a.inv() * b).magnitude() ** 2))))


def resampled_by_length(points: Array, n_points: int = 200) -> Array:
    """Return points equally far apart along a path, its first and last among them. Shape (n_points, D)."""
    travelled = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    at = np.linspace(0.0, travelled[-1], n_points)
    return np.stack([np.interp(at, travelled, axis) for axis in points.T], axis=1)


def dtw_rms(one: Array, other: Array) -> float:
    """Return the root mean square of the distances along the warping path of two resampled motions [m]."""
    squares, steps = _warp(resampled_by_length(one), resampled_by_length(other))
    return float(np.sqrt(squares / steps))


def warping_path(one: Array, other: Array) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the indices of the points that dynamic time warping puts beside each other, from first to last."""
    cost = _costs(np.ascontiguousarray(one), np.ascontiguousarray(other))
    i, j = len(one), len(other)
    pairs = []
    while i > 0:  # the first row and column are infinite but for their corner
        pairs.append((i - 1, j - 1))
        i, j = min([(i - 1, j - 1), (i - 1, j), (i, j - 1)], key=lambda at: cost[at])
    ours, theirs = np.array(pairs[::-1]).T
    return ours, theirs


@kernel
def _costs(a, b):
    """Return the least sum of squared distances up to each pair of points. Shape (n + 1, m + 1)."""
    cost = np.full((a.shape[0] + 1, b.shape[0] + 1), np.inf)
    cost[0, 0] = 0.0
    for i in range(a.shape[0]):
        for j in range(b.shape[0]):
            best = min(cost[i, j], cost[i, j + 1], cost[i + 1, j])
            cost[i + 1, j + 1] = best + np.sum((a[i] - b[j]) ** 2)
    return cost


@kernel
def _warp(a, b):
    """Return the least sum of squared distances over warping paths, and the length of the path that has it."""
    n, m = a.shape[0], b.shape[0]
    cost, length = np.full((n + 1, m + 1), np.inf), np.zeros((n + 1, m + 1))
    cost[0, 0] = 0.0
    for i in range(n):
        for j in range(m):
            best, steps = cost[i, j], length[i, j]  # both move on
            if cost[i, j + 1] < best:
                best, steps = cost[i, j + 1], length[i, j + 1]
            if cost[i + 1, j] < best:
                best, steps = cost[i + 1, j], length[i + 1, j]
            cost[i + 1, j + 1] = best + np.sum((a[i] - b[j]) ** 2)
            length[i + 1, j + 1] = steps + 1.0
    return cost[n, m], length[n, m]
