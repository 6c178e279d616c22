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


@dataclass(frozen=True)
class Gaussians:
    """The components in the world at this instant: means (K, D), covariances and precisions (K, D, D)."""

    means: Array
    covariances: Array
    precisions: Array

    def distance(self, component: int, position: Array) -> float:
        """Mahalanobis distance of a position to one component."""
        e = position - self.means[component]
        return float(np.sqrt(e @ self.precisions[component] @ e))

    def lateral_distance(self, component: int, origin: int, position: Array) -> float:
        """The same, without the part along the way from another component."""
        along = self.means[component] - self.means[origin]
        e = position - self.means[component]
        square = along @ along
        if square > 0.0:
            e = e - along * ((along @ e) / square)
        return float(np.sqrt(e @ self.precisions[component] @ e))

    def most_likely(self, position: Array) -> int:
        """Component of highest likelihood at a position."""
        e = position - self.means
        mahalanobis = np.einsum("kd,kde,ke->k", e, self.precisions, e)
        return int(np.argmin(mahalanobis + np.linalg.slogdet(self.covariances)[1]))


class ProgressTracker:
    """Follows the chain of a model; itself without memory.

    Args:
        model: The learned task.
        start: Where the motion began in each frame, if that was where demonstrations began. Shape (P, D).

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

    def start(self, position: Array, gaussians: Gaussians) -> Progress:
        """Begin where demonstrations began if that is near, else at the nearest component (Sec. VI)."""
        distances = np.linalg.norm(position - gaussians.means, axis=1)
        first = np.where(self.model.initial > 0, distances, np.inf)
        if first.min() <= _START_REACH * self.model.max_distance_m:
            return Progress(int(np.argmin(first)), from_start=True)
        return Progress(int(np.argmin(np.where(self.model.terminal, np.inf, distances))))

    def advance(
        self, now: Progress, position: Array, velocity: Array, gaussians: Gaussians, dt: float
    ) -> Progress:
        """The progress one control period later.

        Args:
            now: The progress so far.
            position: Of the robot in the world [m]. Shape (D,).
            velocity: Relative to the task frames [m/s]. Shape (D,).
            gaussians: The components at this instant.
            dt: Control period [s].
        """
        q, elapsed = now.component, now.elapsed_s + dt
        here = gaussians.distance(q, position)
        if not now.free and here > _LOST:
            return replace(
                now,
                component=gaussians.most_likely(position),
                elapsed_s=0.0,
                free=True,
                waiting=False,
                arrived=False,
            )
        free = now.free and here >= _INSIDE
        if self.model.terminal[q]:
            e = velocity * _SETTLED_S
            settled = here < _CLOSE and e @ gaussians.precisions[q] @ e < _CLOSE**2
            return replace(
                now, elapsed_s=elapsed, free=free, waiting=False, arrived=now.arrived or bool(settled)
            )
        n, due = int(self.successors[q]), elapsed >= self.durations_s[q]
        if n >= 0 and self._may_advance(q, n, here, due, elapsed, position, gaussians):
            return replace(now, component=n, elapsed_s=0.0, free=free, waiting=False)
        return replace(now, elapsed_s=elapsed, free=free, waiting=bool(due))

    def _may_advance(
        self, q: int, n: int, here: float, due: bool, elapsed: float, position: Array, gaussians: Gaussians
    ) -> bool:
        if elapsed > self.durations_s[q] + _TIME_OUT_S or (due and here < _CLOSE):
            return True
        inside = gaussians.lateral_distance(n, q, position) < _INSIDE
        return bool(inside and (due or gaussians.distance(n, position) < here))

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
        start: Where the motion began in each frame [m]; None when not where demonstrations began. Shape (P, D).
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
    e = start[:, None] - model.start_means
    mahalanobis = np.einsum("pkd,pkd->pk", e, np.linalg.solve(model.start_covariances, e[..., None])[..., 0])
    log_determinant = np.linalg.slogdet(model.start_covariances)[1]
    return -0.5 * (mahalanobis + log_determinant).mean(axis=0)
