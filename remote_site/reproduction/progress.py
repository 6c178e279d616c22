"""Where the motion is in the chain of components: which one, and for how long.

Replanning from the nearest component with its whole duration at every tick never gets anywhere, so the
time spent in the present component is kept. It advances when the robot has come as far as the
demonstrations had, or when it is time; a robot that was pushed away finds the component anew.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from common.errors import InvalidModel
from common.gaussian_product import inverse
from common.manifold import Manifold
from common.tphsmm import TPHSMM

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

# Mahalanobis distances: inside a component, beyond which the robot is lost, close enough to go on.
_INSIDE, _LOST, _CLOSE = 3.0, 5.0, 1.0
# An execution that waits for its next component goes on after this time [s].
_TIME_OUT_S = 2.0
# Starts within this many lambda of a component in which a demonstration began start there.
_START_REACH = 1.5
# Arrived: within one standard deviation of the end, and staying there for this time at the present speed.
_SETTLED_S = 0.2


@dataclass(frozen=True)
class Progress:
    """The state of an execution in the chain of components.

    Args:
        component: Present component q.
        elapsed_s: Time since it was entered [s].
        free: On the way to a component that was not reached yet.
        waiting: Due for the next component, but not near enough.
        arrived: The motion has come to its end.
        from_start: It began where demonstrations began.
    """

    component: int
    elapsed_s: float = 0.0
    free: bool = True
    waiting: bool = False
    arrived: bool = False
    from_start: bool = False


@dataclass(frozen=True, eq=False)
class Gaussians:
    """The components in the world at this instant.

    A pose is as far away as the worse of its two parts, position and rotation, so that the gates mean the
    same in every space.

    Args:
        space: Positions or poses.
        means: Shape (K, C).
        covariances: Shape (K, T, T).
        precisions: Their inverses. Shape (K, T, T).
        part_precisions: The inverses of position's and rotation's own covariances. Shape (K, T, T).
    """

    space: Manifold
    means: Array
    covariances: Array
    precisions: Array
    part_precisions: Array

    @classmethod
    def of(cls, means: Array, covariances: Array) -> Gaussians:
        """From means (K, C) and covariances (K, T, T)."""
        space, precisions = Manifold.of(means.shape[1], covariances.shape[2]), inverse(covariances)
        parts = precisions
        if space.oriented:
            parts = np.zeros_like(covariances)
            for part in space.parts:
                parts[:, part, part] = inverse(covariances[:, part, part])
        return cls(space, means, covariances, precisions, parts)

    def distance(self, component: int, point: Array) -> float:
        """Mahalanobis distance of a point to one component."""
        return self.length(component, self.space.log(self.means[component], point))

    def lateral_distance(self, component: int, origin: int, point: Array) -> float:
        """The same, without the part along the way from another component."""
        along = self.space.log(self.means[component], self.means[origin])
        e = self.space.log(self.means[component], point)
        for part in self.space.parts:
            square = along[part] @ along[part]
            if square > 0.0:
                e[part] -= along[part] * ((along[part] @ e[part]) / square)
        return self.length(component, e)

    def length(self, component: int, tangent: Array) -> float:
        """Length of a tangent in standard deviations of one component, of its worse part."""
        P = self.part_precisions[component]
        return float(np.sqrt(max(tangent[s] @ P[s, s] @ tangent[s] for s in self.space.parts)))

    def most_likely(self, point: Array) -> int:
        """Component of highest likelihood at a point."""
        e = self.space.log(self.means, point)
        mahalanobis = np.einsum("kd,kde,ke->k", e, self.precisions, e)
        return int(np.argmin(mahalanobis + np.linalg.slogdet(self.covariances)[1]))


class ProgressTracker:
    """Follows the chain of a model; itself without memory.

    Args:
        model: The learned task.
        start: Where the motion began in each frame, if that was where demonstrations began. Shape (P, C).

    Raises:
        InvalidModel: When no component is terminal, so that no motion could ever end.
    """

    def __init__(self, model: TPHSMM, start: Array | None = None):
        if not model.terminal.any():
            raise InvalidModel("model", "terminal", "a component where a demonstration ended; end one first")
        self.model = model
        self.successors = successors(model, start)
        self.durations_s = model.duration_mean_s
        self.remaining_s = self._remaining()

    def start(self, point: Array, gaussians: Gaussians) -> Progress:
        """Begin where demonstrations began if that is near, else at the nearest component (Sec. VI)."""
        lambda_m = self.model.max_distance_m
        distances = gaussians.space.distance(gaussians.means, point, metres_per_radian=lambda_m)
        first = np.where(self.model.initial > 0, distances, np.inf)
        if first.min() <= _START_REACH * lambda_m:
            return Progress(int(np.argmin(first)), from_start=True)
        return Progress(int(np.argmin(np.where(self.model.terminal, np.inf, distances))))

    def advance(
        self, now: Progress, point: Array, velocity: Array, gaussians: Gaussians, dt: float
    ) -> Progress:
        """The progress one control period later.

        Args:
            now: The progress so far.
            point: Of the robot in the world. Shape (C,).
            velocity: Relative to the task frames [m/s, rad/s]. Shape (T,).
            gaussians: The components at this instant.
            dt: Control period [s].
        """
        q, elapsed = now.component, now.elapsed_s + dt
        here = gaussians.distance(q, point)
        if not now.free and here > _LOST:
            return replace(
                now,
                component=gaussians.most_likely(point),
                elapsed_s=0.0,
                free=True,
                waiting=False,
                arrived=False,
            )
        free = now.free and here >= _INSIDE
        if self.model.terminal[q]:
            settled = here < _CLOSE and gaussians.length(q, velocity * _SETTLED_S) < _CLOSE
            return replace(
                now, elapsed_s=elapsed, free=free, waiting=False, arrived=now.arrived or bool(settled)
            )
        n, due = int(self.successors[q]), elapsed >= self.durations_s[q]
        if n >= 0 and self._may_advance(q, n, here, due, elapsed, point, gaussians):
            return replace(now, component=n, elapsed_s=0.0, free=free, waiting=False)
        return replace(now, elapsed_s=elapsed, free=free, waiting=bool(due))

    def _may_advance(
        self, q: int, n: int, here: float, due: bool, elapsed: float, point: Array, gaussians: Gaussians
    ) -> bool:
        if elapsed > self.durations_s[q] + _TIME_OUT_S or (due and here < _CLOSE):
            return True
        inside = gaussians.lateral_distance(n, q, point) < _INSIDE
        return bool(inside and (due or gaussians.distance(n, point) < here))

    def time_to_go(self, now: Progress) -> float:
        """Time until the end of the motion as it was demonstrated [s]."""
        q = now.component
        return float(self.remaining_s[q] - min(now.elapsed_s, self.durations_s[q]))

    def _remaining(self) -> Array:
        remaining = np.zeros(self.model.n_components)
        for i in range(self.model.n_components):
            q = i
            while q >= 0 and not self.model.terminal[q]:
                remaining[i] += self.durations_s[q]
                q = self.successors[q]
        return remaining


def successors(model: TPHSMM, start: Array | None = None) -> Integers:
    """The component that follows each one, -1 for none; following them never comes back.

    It is the most probable among those visited later in the demonstrations, given where the motion
    started. Where that leads to no terminal component, it is the most probable of those that do.

    Args:
        model: The learned task.
        start: Where the motion began in each frame [m]; None when not where demonstrations began. Shape (P, C).
    """
    with np.errstate(divide="ignore"):
        score = np.log(model.transition)  # log a_ij, -inf where never seen
    if start is not None:
        score = score + start_log_likelihood(model, start)
    forward = np.where((model.phase[None, :] > model.phase[:, None]) | model.terminal, score, -np.inf)
    following = np.where(forward.max(axis=1) > -np.inf, np.argmax(forward, axis=1), -1)
    following[model.terminal] = -1
    reaches = model.terminal.copy()
    for _ in range(model.n_components):  # phases increase along the chain, so it is at most K long
        reaches |= (following >= 0) & reaches[following]
    while True:
        into = np.where(reaches, score, -np.inf)
        best = np.where(reaches, -np.inf, into.max(axis=1))
        i = int(np.argmax(best))
        if best[i] == -np.inf:
            break
        following[i] = np.argmax(into[i])
        reaches[i] = True
    following[~reaches] = -1
    return following


def start_log_likelihood(model: TPHSMM, start: Array) -> Array:
    """Log density of a start among those of the demonstrations that visited each component. Shape (K,)."""
    e = model.manifold.log(model.start_means, start[:, None])
    mahalanobis = np.einsum("pkd,pkd->pk", e, np.linalg.solve(model.start_covariances, e[..., None])[..., 0])
    log_determinant = np.linalg.slogdet(model.start_covariances)[1]
    return -0.5 * (mahalanobis + log_determinant).mean(axis=0)
