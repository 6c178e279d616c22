"""Way: a whole motion as demonstrations made it, and how it depends on where it starts (an extension).

The paper's components say where motions pass; a way says, of demonstrations that went alike, where a motion
passes that begins at a given start. At N + 1 equal phases it has the mean of the demonstrations, and at
M + 1 coarse ones the regression on the start s and what that leaves:

    x_k(s) = exp(mean_k, G_k log(mean_0, s)),    G_0 = I,  G_N = 0

Position and rotation are regressed each by itself, so that all matrices have zeros between them. Between the
coarse phases gains follow a monotone cubic, everything else a line.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from farhand.common.errors import InvalidModel
from farhand.common.model.manifold import Manifold
from farhand.common.model.task_frame import TaskFrame

Array = NDArray[np.float64]

N_PHASES, N_COARSE = 32, 8
MAX_WAYS = 64
# Standard deviation of an entry of the gains before anything was shown.
GAIN_STD = 0.3
# How far starts spread before anything was shown [lambda, rad], and how many demonstrations that is worth.
START_SPREAD, START_WEIGHT = 0.2, 3.0
# A way serves where a motion may be this far from what is expected of it at most [lambda, rad].
_REACH = 0.5
# Scenes further from the demonstrated ones than so many times as these are from their mean are outside.
OUTSIDE = 3.0
# A motion takes no less than this part of the mean time between two phases, and its whole time within this factor.
_SHORTEST, _LONGEST = 0.4, 2.0

# Shape of every array: P frames, N + 1 phases, M + 1 coarse phases, C coordinates, T tangent numbers, B parts.
ARRAY_FIELDS = {
    "points": "PNC",
    "time_shares": "N",
    "gains": "PMTT",
    "covariances": "PMTT",
    "start_covariances": "PTT",
    "time_gains": "MT",
    "duration_gains": "T",
    "deviations": "MB",
}


@dataclass(frozen=True, eq=False, kw_only=True)
class Way:
    """Course of a motion, as regressed from demonstrations that went alike.

    Args:
        n_demonstrations: How many they are.
        terminal: The terminal component in which most of them ended.
        duration_s: How long they took, the geometric mean [s].
        points: Their means at equal phases. Shape (P, N + 1, C).
        time_shares: Mean fraction of the time at each phase, from 0 to 1. Shape (N + 1,).
        gains: Regression of the points on the start, at the coarse phases. Shape (P, M + 1, T, T).
        covariances: What the regression leaves, with the minimum covariance. Shape (P, M + 1, T, T).
        start_covariances: Of the starts, seen from each frame. Shape (P, T, T).
        time_gains: Regression of the time shares on the start [1/m, 1/rad]. Shape (M + 1, T).
        duration_gains: Regression of the duration's logarithm on the start [1/m, 1/rad]. Shape (T,).
        deviations: Noise of the regression of each part, seen from the goal [m, rad]. Shape (M + 1, B).

    Raises:
        InvalidModel: Naming the field whose shape or range is wrong.
    """

    n_demonstrations: int
    terminal: int
    duration_s: float
    points: Array
    time_shares: Array
    gains: Array
    covariances: Array
    start_covariances: Array
    time_gains: Array
    duration_gains: Array
    deviations: Array

    def __post_init__(self) -> None:
        points, covariances = np.asarray(self.points), np.asarray(self.covariances)
        if points.ndim != 3 or covariances.ndim != 4:
            raise InvalidModel("model", "ways", f"points (P, N + 1, C), got {points.shape}")
        space = Manifold.of(points.shape[2], covariances.shape[3])
        sizes = {"P": points.shape[0], "N": N_PHASES + 1, "M": N_COARSE + 1}
        sizes |= {"C": space.n_coordinates, "T": space.n_tangent, "B": len(space.parts)}
        for name, axes in ARRAY_FIELDS.items():
            array = np.array(getattr(self, name), dtype=np.float64, order="C")
            if array.shape != tuple(sizes[axis] for axis in axes) or not np.isfinite(array).all():
                raise InvalidModel(
                    "model", f"ways.{name}", f"finite numbers of shape {axes}, got {array.shape}"
                )
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        if self.n_demonstrations < 1 or not (np.isfinite(self.duration_s) and self.duration_s > 0.0):
            raise InvalidModel("model", "ways", "one demonstration or more, of a positive duration")
        if (np.diff(self.time_shares) < 0.0).any() or (self.deviations <= 0.0).any():
            raise InvalidModel("model", "ways", "times that do not decrease, and positive deviations")
        if np.linalg.eigvalsh(self.covariances).min() <= 0.0:
            raise InvalidModel("model", "ways.covariances", "positive definite matrices")

    @property
    def space(self) -> Manifold:
        """Positions or poses."""
        return Manifold.of(self.points.shape[2], self.covariances.shape[3])

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Way):
            return NotImplemented
        return all(np.array_equal(getattr(self, f.name), getattr(other, f.name)) for f in fields(self))

    def __hash__(self) -> int:
        return hash(self.points.tobytes())

    def course(self, start: Array) -> Array:
        """Return the points of a motion that begins at a start. Shapes (P, C), (P, N + 1, C)."""
        e = self.space.log(self.points[:, 0], start)
        gains = between_coarse(self.gains, axis=1, smooth=True)
        return self.space.exp(self.points, np.einsum("pktu,pu->pkt", gains, e))

    def times_s(self, start: Array) -> Array:
        """Return when a motion from a start passes each phase, from zero [s]. Shapes (P, C), (N + 1,)."""
        e = self.space.log(self.points[-1, 0], start[-1])
        mean = np.diff(self.time_shares)
        steps = np.maximum(mean + np.diff(between_coarse(self.time_gains, axis=0) @ e), _SHORTEST * mean)
        longer = np.clip(self.duration_gains @ e, -np.log(_LONGEST), np.log(_LONGEST))
        steps = np.maximum(steps / steps.sum() * self.duration_s * np.exp(longer), 1e-3)
        return np.concatenate([[0.0], np.cumsum(steps)])

    def unsureness(self, start: Array, max_distance_m: float) -> float:
        """Return how far a motion from a start may be from where it is expected, in lambda or radians.

        That is the standard deviation of the regression's prediction, at its worst phase and of the worse
        part.

        Args:
            start: Seen from the goal. Shape (C,).
            max_distance_m: The lambda [m].
        """
        e, n, worst = self.space.log(self.points[-1, 0], start), self.n_demonstrations, 0.0
        for number, part in enumerate(self.space.parts):
            unit = max_distance_m if number == 0 else 1.0
            square = spread_squares(
                n * self.start_covariances[-1, part, part], e[part], self.deviations[:, number]
            )
            deviation = self.deviations[:, number] * np.sqrt(1.0 / n + square)
            worst = max(worst, float(deviation.max()) / unit)
        return worst

    def growth(self, start: Array) -> Array:
        """Return by how much more a new motion's points vary than the covariances say, since the regression is unsure.

        It is known from few demonstrations, the less the further away from their starts the new one is.

        Args:
            start: Where the motion begins in each frame. Shape (P, C).

        Returns:
            Factors of variances, of each part's tangents. Shape (P, M + 1, T).
        """
        e, n = self.space.log(self.points[:, 0], start), self.n_demonstrations
        factors = np.ones((*self.gains.shape[:2], self.space.n_tangent))
        for p, scatter in enumerate(n * self.start_covariances):
            for number, part in enumerate(self.space.parts):
                leverage = spread_squares(scatter[part, part], e[p, part], self.deviations[:, number])
                factors[p, :, part] += (1.0 / n + leverage)[:, None]
        return factors

    def log_likelihood(self, start: Array, max_distance_m: float) -> float:
        """Return the log density of a start among those of the way, and of the way among the demonstrations."""
        e, total = self.space.log(self.points[-1, 0], start), float(np.log(self.n_demonstrations))
        for number, part in enumerate(self.space.parts):
            prior = START_WEIGHT * (START_SPREAD * (max_distance_m if number == 0 else 1.0)) ** 2
            C = self.start_covariances[-1, part, part] + prior / self.n_demonstrations * np.eye(e[part].size)
            total -= 0.5 * float(e[part] @ np.linalg.solve(C, e[part]) + np.linalg.slogdet(C)[1])
        return total

    def distances(self, point: Array, frames: Sequence[TaskFrame], max_distance_m: float) -> Array:
        """Return how many times further away than in the demonstrations a motion begins and ends, seen from each frame.

        Counted from the mean, of position or rotation whichever is further. The goal's own frame sees the start alone.

        Args:
            point: Where the motion begins, in the world. Shape (C,).
            frames: The task frames then. Length P.
            max_distance_m: The lambda [m].

        Returns:
            Shape (P,).
        """
        end = frames[-1].to_world(self.points[-1, -1])
        found = [
            max(
                self._distance(e, scatter, max_distance_m)
                for e, scatter in (
                    (self.space.log(self.points[p, 0], frame.to_local(point)), self.start_covariances[p]),
                    (self.space.log(self.points[p, -1], frame.to_local(end)), self.covariances[p, -1]),
                )
            )
            for p, frame in enumerate(frames)
        ]
        return np.array(found)

    def _distance(self, e: Array, covariance: Array, max_distance_m: float) -> float:
        """Length of a tangent of n demonstrations' covariance, in the root of its trace, of the worse part."""
        n, worst = self.n_demonstrations, 0.0
        for number, part in enumerate(self.space.parts):
            prior = START_WEIGHT * (START_SPREAD * (max_distance_m if number == 0 else 1.0)) ** 2
            spread = np.trace(covariance[part, part]) * n / max(n - 1, 1)
            worst = max(worst, float(np.linalg.norm(e[part]) / np.sqrt(spread + prior * e[part].size / n)))
        return worst


def chosen_way(ways: Sequence[Way], start: Array, max_distance_m: float) -> int:
    """Return the number of the way that a motion from a start takes; -1 when none is sure enough.

    Args:
        ways: Of a model.
        start: Where the motion begins, seen from the goal. Shape (C,).
        max_distance_m: The lambda [m].
    """
    best, most = -1, -np.inf
    for number, way in enumerate(ways):
        if way.unsureness(start, max_distance_m) <= _REACH:
            likelihood = way.log_likelihood(start, max_distance_m)
            if likelihood > most:
                best, most = number, likelihood
    return best


def distance_from_taught(
    ways: Sequence[Way], point: Array, frames: Sequence[TaskFrame], max_distance_m: float
) -> tuple[float, int]:
    """Return how many times further away than the demonstrated ones a scene is, and the frame that sees it so.

    Of the nearest way, and of the frame that sees it furthest away. More than `OUTSIDE` is outside of what was shown.
    Arguments as of `Way.distances`.
    """
    seen = [way.distances(point, frames, max_distance_m) for way in ways]
    nearest = min(seen, key=np.max, default=np.zeros(len(frames)))
    return float(nearest.max()), int(np.argmax(nearest))


def spread_squares(S: Array, e: Array, deviations: Array) -> Array:
    """Return e^T (S + sigma^2 / h0^2 I)^-1 e for each sigma: what a start away from the others is worth.

    Args:
        S: Scatter of the starts. Shape (n, n).
        e: Tangent from their mean to a start. Shape (n,).
        deviations: The sigmas. Shape (M + 1,).
    """
    values, axes = np.linalg.eigh(S)
    along = axes.T @ e
    return (along**2 / (np.maximum(values, 0.0) + (deviations[:, None] / GAIN_STD) ** 2)).sum(axis=1)


def between_coarse(values: Array, axis: int, smooth: bool = False) -> Array:
    """Return what is known at the coarse phases at all of them, along one axis of length M + 1."""
    coarse, fine = np.linspace(0.0, 1.0, N_COARSE + 1), np.linspace(0.0, 1.0, N_PHASES + 1)
    if smooth:
        return np.asarray(PchipInterpolator(coarse, values, axis=axis)(fine), dtype=np.float64)
    at = fine * N_COARSE
    low = np.minimum(at.astype(int), N_COARSE - 1)
    share = np.reshape(at - low, [-1 if a == axis else 1 for a in range(values.ndim)])
    return np.take(values, low, axis=axis) * (1.0 - share) + np.take(values, low + 1, axis=axis) * share
