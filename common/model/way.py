"""Way: a whole motion as demonstrations made it, and how it depends on where it starts (an extension).

The paper's components describe the region of all motions; a way predicts, from similar demonstrations, the one
motion that begins at a given start. It has the mean of the demonstrations at N + 1 equal phases, and at M + 1
coarse phases the regression on the start s with its residual covariance:

    x_k(s) = exp(mean_k, G_k log(mean_0, s)),    G_0 = I,  G_N = 0

Position and rotation are regressed separately, so all matrices are block diagonal. Between the coarse phases
gains are interpolated by a monotone cubic, all other quantities linearly.
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
# Prior standard deviation of an entry of the gains.
GAIN_STD = 0.3
# Prior spread of the starts [lambda, rad], and its weight in demonstrations.
START_SPREAD, START_WEIGHT = 0.2, 3.0
# A way is used for a start only if its prediction has at most this standard deviation [lambda, rad].
_REACH = 0.5
# A scene counts as outside of the demonstrated ones beyond this multiple of their own spread.
OUTSIDE = 3.0
# Least share of the mean time between two phases, and largest factor between a motion's duration and the mean.
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
    """Course of a motion, regressed from similar demonstrations.

    Args:
        n_demonstrations: Number of demonstrations.
        terminal: Terminal component in which most of them ended.
        duration_s: Geometric mean of their durations [s].
        points: Mean points at equal phases. Shape (P, N + 1, C).
        time_shares: Mean fraction of the time at each phase, from 0 to 1. Shape (N + 1,).
        gains: Regression of the points on the start, at the coarse phases. Shape (P, M + 1, T, T).
        covariances: Residual covariances of the regression, with the minimum covariance. Shape (P, M + 1, T, T).
        start_covariances: Covariances of the starts relative to each frame. Shape (P, T, T).
        time_gains: Regression of the time shares on the start [1/m, 1/rad]. Shape (M + 1, T).
        duration_gains: Regression of the duration's logarithm on the start [1/m, 1/rad]. Shape (T,).
        deviations: Noise of the regression of each part, relative to the goal [m, rad]. Shape (M + 1, B).

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
        """Space of the points: positions or poses."""
        return Manifold.of(self.points.shape[2], self.covariances.shape[3])

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Way):
            return NotImplemented
        return all(np.array_equal(getattr(self, f.name), getattr(other, f.name)) for f in fields(self))

    def __hash__(self) -> int:
        return hash(self.points.tobytes())

    def course(self, start: Array) -> Array:
        """Return the predicted points (P, N + 1, C) of a motion that begins at a start (P, C)."""
        e = self.space.log(self.points[:, 0], start)
        gains = between_coarse(self.gains, axis=1, smooth=True)
        return self.space.exp(self.points, np.einsum("pktu,pu->pkt", gains, e))

    def times_s(self, start: Array) -> Array:
        """Return the times (N + 1,) of the phases of a motion from a start (P, C), from zero [s]."""
        e = self.space.log(self.points[-1, 0], start[-1])
        mean = np.diff(self.time_shares)
        steps = np.maximum(mean + np.diff(between_coarse(self.time_gains, axis=0) @ e), _SHORTEST * mean)
        longer = np.clip(self.duration_gains @ e, -np.log(_LONGEST), np.log(_LONGEST))
        steps = np.maximum(steps / steps.sum() * self.duration_s * np.exp(longer), 1e-3)
        return np.concatenate([[0.0], np.cumsum(steps)])

    def unsureness(self, start: Array, max_distance_m: float) -> float:
        """Return the standard deviation of the prediction from a start, at the worst phase and of the worse part.

        It is in lambda for positions, in radians for rotations.

        Args:
            start: Start relative to the goal. Shape (C,).
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
        """Return the factors by which the regression's own uncertainty enlarges the variances of a new motion.

        They grow with the distance of its start from the demonstrated ones, and shrink with the number of those.

        Args:
            start: Start of the motion in each frame. Shape (P, C).

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
        """Return the distances of a motion's start and end from the demonstrated ones, as multiples of their spread.

        For each frame it is the larger one of start and end, position and rotation. In the goal's own frame only the
        start counts, because the end is always at the mean.

        Args:
            point: Start of the motion in the world. Shape (C,).
            frames: Task frames at the start. Length P.
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
        """Return the length of a tangent in units of the demonstrations' spread (root of the trace), for the worse part."""
        n, worst = self.n_demonstrations, 0.0
        for number, part in enumerate(self.space.parts):
            prior = START_WEIGHT * (START_SPREAD * (max_distance_m if number == 0 else 1.0)) ** 2
            spread = np.trace(covariance[part, part]) * n / max(n - 1, 1)
            worst = max(worst, float(np.linalg.norm(e[part]) / np.sqrt(spread + prior * e[part].size / n)))
        return worst


def chosen_way(ways: Sequence[Way], start: Array, max_distance_m: float) -> int:
    """Return the number of the most likely way for a start; -1 if the prediction of none is certain enough.

    Args:
        ways: Ways of a model.
        start: Start of the motion relative to the goal. Shape (C,).
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
    """Return the distance of a scene from the demonstrated ones, as a multiple of their spread, and its frame.

    It is the distance from the nearest way, in the frame in which that is largest. Above `OUTSIDE` the scene is
    outside of the demonstrated ones. Arguments as of `Way.distances`.
    """
    seen = [way.distances(point, frames, max_distance_m) for way in ways]
    nearest = min(seen, key=np.max, default=np.zeros(len(frames)))
    return float(nearest.max()), int(np.argmax(nearest))


def spread_squares(S: Array, e: Array, deviations: Array) -> Array:
    """Return the leverage e^T (S + sigma^2 / h0^2 I)^-1 e of a start for each sigma.

    Args:
        S: Scatter of the starts. Shape (n, n).
        e: Tangent from their mean to a start. Shape (n,).
        deviations: The sigmas. Shape (M + 1,).
    """
    values, axes = np.linalg.eigh(S)
    along = axes.T @ e
    return (along**2 / (np.maximum(values, 0.0) + (deviations[:, None] / GAIN_STD) ** 2)).sum(axis=1)


def between_coarse(values: Array, axis: int, smooth: bool = False) -> Array:
    """Interpolate values from the coarse phases to all phases, along one axis of length M + 1."""
    coarse, fine = np.linspace(0.0, 1.0, N_COARSE + 1), np.linspace(0.0, 1.0, N_PHASES + 1)
    if smooth:
        return np.asarray(PchipInterpolator(coarse, values, axis=axis)(fine), dtype=np.float64)
    at = fine * N_COARSE
    low = np.minimum(at.astype(int), N_COARSE - 1)
    share = np.reshape(at - low, [-1 if a == axis else 1 for a in range(values.ndim)])
    return np.take(values, low, axis=axis) * (1.0 - share) + np.take(values, low + 1, axis=axis) * share
