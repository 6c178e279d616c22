"""Progress of an execution: the present component, and the time since it was entered.

Replanning from the nearest component with its whole duration at every tick never gets anywhere, so the time
spent in the present component is kept. The progress advances when the robot has come as far as the
demonstrations had, or when the component's time is over. A robot that was pushed off its way looks for a
component again, early enough in the chain that it can still come in as demonstrated.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from farhand.common.errors import InvalidInput, InvalidModel
from farhand.common.model.tphsmm import TPHSMM
from farhand.remote_site.reproduction.chains import successors
from farhand.remote_site.reproduction.gaussians import Gaussians

Array = NDArray[np.float64]

# Mahalanobis distances: inside a component; lost; close enough to go on.
_INSIDE, _LOST, _CLOSE = 3.0, 5.0, 1.0
# An execution that waits for its next component stops waiting after this time [s].
_TIME_OUT_S = 2.0
# A start this close (in lambda) to a component in which a demonstration began, begins in it.
_START_REACH = 1.5
# Limit of setbacks on the way to a component; it bounds any cycle.
_MAX_SETBACKS = 5
_TINY_M = 1e-12
# Arrived: within this many standard deviations of the end, and staying there for this time at the present speed.
_ARRIVED, _SETTLED_S = 0.4, 0.2


@dataclass(frozen=True)
class Progress:
    """State of an execution in the chain of components.

    Args:
        component: Present component q.
        elapsed_s: Time since it was entered, without the time spent waiting for the robot [s].
        behind_s: Time for which the clock stood because the robot was behind the demonstrations in it [s].
        free: True on the way to a component that was not reached yet.
        waiting: True when the next component is due but not near enough.
        arrived: True once the motion has ended.
        from_start: True if it began where demonstrations began.
        setbacks: Number of setbacks on the way to a component.
    """

    component: int
    elapsed_s: float = 0.0
    behind_s: float = 0.0
    free: bool = True
    waiting: bool = False
    arrived: bool = False
    from_start: bool = False
    setbacks: int = 0


class ProgressTracker:
    """Stateless rules that advance a `Progress` along the chain of a model.

    Args:
        model: The learned task.
        start: Start of the motion in each frame, if demonstrations began there. Shape (P, C).
        n_learned: Number of learned components, all when not given. Those after them belong to the way that
            the execution takes.

    Raises:
        InvalidModel: When no component is terminal, so that no motion could ever end.
    """

    def __init__(self, model: TPHSMM, start: Array | None = None, n_learned: int | None = None):
        if not model.terminal.any():
            raise InvalidModel("model", "terminal", "a component where a demonstration ended; end one first")
        self.model = model
        self._n_learned = model.n_components if n_learned is None else n_learned
        self.successors = successors(model, start)
        self.durations_s = model.duration_mean_s
        self.remaining_s = self._remaining()
        self._from_the_end = [int(i) for i in self._steps_to_go().argsort() if self.successors[i] >= 0]

    def start(self, point: Array, gaussians: Gaussians) -> Progress:
        """Begin where demonstrations began if that is near, else at the nearest component (Sec. VI).

        Raises:
            InvalidInput: When the robot is behind the end of the motion, where no demonstration came from.
        """
        gaussians.see(None)
        lambda_m = self.model.max_distance_m
        distances = gaussians.space.distance(gaussians.means, point, metres_per_radian=lambda_m)
        first = np.where(self.model.initial > 0, distances, np.inf)
        if first.min() <= _START_REACH * lambda_m:
            return Progress(int(np.argmin(first)), from_start=True)
        self._refuse_behind_the_end(point, gaussians, int(np.argmin(distances)))
        return Progress(int(np.argmin(np.where(self._joinable(point, gaussians), distances, np.inf))))

    def advance(
        self, now: Progress, point: Array, velocity: Array, gaussians: Gaussians, dt: float
    ) -> Progress:
        """Return the progress one control period later.

        Args:
            now: The progress so far.
            point: Point of the robot in the world. Shape (C,).
            velocity: Velocity relative to the task frames [m/s, rad/s]. Shape (T,).
            gaussians: The components at this instant.
            dt: Control period [s].
        """
        q = now.component
        elapsed, behind = self._clocks(now, point, gaussians, dt)
        here = gaussians.distance(q, point)
        n, due = int(self.successors[q]), elapsed >= self.durations_s[q]
        if self._lost(now, here, point, gaussians):
            found = self._rejoined(point, gaussians)
            # Finding the same component again on the way to it is no progress: its time-out must go on.
            again = found == q and now.free
            setbacks = now.setbacks + now.free
            return replace(
                now,
                component=found,
                elapsed_s=elapsed if again else 0.0,
                behind_s=behind if again else 0.0,
                free=True,
                waiting=False,
                arrived=False,
                setbacks=setbacks,
            )
        free = now.free and here >= _INSIDE
        if self.model.terminal[q]:
            settled = here < _ARRIVED and gaussians.length(q, velocity * _SETTLED_S) < _ARRIVED
            return replace(
                now, elapsed_s=elapsed, free=free, waiting=False, arrived=now.arrived or bool(settled)
            )
        if n >= 0 and self._may_advance(q, n, here, due, elapsed + behind, point, gaussians):
            on_the_way = gaussians.distance(n, point) >= _INSIDE
            return replace(now, component=n, elapsed_s=0.0, behind_s=0.0, free=on_the_way, waiting=False)
        return replace(now, elapsed_s=elapsed, behind_s=behind, free=free, waiting=bool(due))

    def _clocks(self, now: Progress, point: Array, gaussians: Gaussians, dt: float) -> tuple[float, float]:
        """Return the time in the component, and the time behind in it, one control period later [s]."""
        q, elapsed = now.component, now.elapsed_s
        under_way = not self.model.terminal[q] and elapsed < self.durations_s[q]
        if under_way and gaussians.is_behind_way(q, elapsed / self.durations_s[q], point, _INSIDE):
            return elapsed, now.behind_s + dt
        return elapsed + dt, now.behind_s

    def _lost(self, now: Progress, here: float, point: Array, gaussians: Gaussians) -> bool:
        """Decide whether the robot left its way, or can no longer join the component that it heads for."""
        q, n = now.component, int(self.successors[now.component])
        if now.free:
            if now.setbacks >= _MAX_SETBACKS:
                return False
            on_a_way = q >= self._n_learned
            return here > _LOST and n >= 0 and (on_a_way or not self._joinable(point, gaussians)[q])
        return here > _LOST and gaussians.distance_to_way(q, n, point) > _LOST

    def _may_advance(
        self, q: int, n: int, here: float, due: bool, stayed: float, point: Array, gaussians: Gaussians
    ) -> bool:
        if stayed > self.durations_s[q] + _TIME_OUT_S:
            return True
        inside = gaussians.lateral_distance(n, q, point) < _INSIDE
        if not due:
            return bool(inside and gaussians.distance(n, point) < here)
        return bool(inside or here < _CLOSE or gaussians.distance_to_exit(q, point) < _INSIDE)

    def _rejoined(self, point: Array, gaussians: Gaussians) -> int:
        """Return the component that a lost robot joins.

        If its execution took a way, and it stands on that again, it goes on from there; elsewhere the learned
        components alone are known.
        """
        joinable = self._joinable(point, gaussians)  # which sees all components
        if self._n_learned < self.model.n_components:
            of_way = range(self._n_learned, self.model.n_components)
            away = [gaussians.distance_to_way(q, int(self.successors[q]), point) for q in of_way]
            if min(away) < _LOST:
                return self._n_learned + int(np.argmin(away))
        return gaussians.most_likely(point, joinable)

    def _joinable(self, point: Array, gaussians: Gaussians) -> NDArray[np.bool_]:
        """Mark the components whose entry is nearer than the path that remains from there; at least one.

        Shape (K,).

        In front of an entry only the distance beside the path counts: the robot comes in along it.
        """
        gaussians.see(None)
        entries = gaussians.entries[:, : self.model.manifold.n_dims]
        steps = entries[self.successors] - entries
        lengths = np.linalg.norm(steps, axis=1)
        to_go = np.zeros(len(entries))
        for i in self._from_the_end:
            to_go[i] = lengths[i] + to_go[self.successors[i]]
        e = point[: entries.shape[1]] - entries
        in_front = np.minimum(np.sum(e * steps, axis=1) / np.maximum(lengths, _TINY_M), 0.0)
        spare = to_go - np.sqrt(np.maximum(np.sum(e * e, axis=1) - in_front**2, 0.0))
        spare[self.successors < 0] = -np.inf
        spare[self._n_learned :] = -np.inf
        return spare >= min(0.0, spare.max())

    def _refuse_behind_the_end(self, point: Array, gaussians: Gaussians, nearest: int) -> None:
        end = nearest if self.model.terminal[nearest] else int(self.successors[nearest])
        if end < 0 or not self.model.terminal[end]:
            return
        before = np.flatnonzero(self.successors == end)
        if before.size and all(gaussians.is_behind(int(q), end, point, _INSIDE) for q in before):
            where = "the robot is behind the end of the motion, where no demonstration came from"
            raise InvalidInput("executor", "start", f"{where}: drive it back to in front of it first")

    def ahead(self, component: int, horizon_s: float) -> NDArray[np.int64]:
        """Return the components that a tick needs: the present one, and those that follow it within the horizon."""
        chain, left_s = [component], horizon_s
        while left_s >= 0.0 and (q := int(self.successors[chain[-1]])) >= 0:
            left_s -= self.durations_s[q]
            chain.append(q)
        if (q := int(self.successors[chain[-1]])) >= 0:
            chain.append(q)  # sums of durations are rounded
        return np.array(chain)

    def time_to_go(self, now: Progress) -> float:
        """Return the demonstrated time to the end of the motion [s]."""
        q = now.component
        return float(self.remaining_s[q] - min(now.elapsed_s, self.durations_s[q]))

    def _steps_to_go(self) -> NDArray[np.int64]:
        """Return the number of components after each one. Shape (K,)."""
        return self._along_the_chain(np.ones(self.model.n_components), self.successors < 0).astype(np.int64)

    def _remaining(self) -> Array:
        """Return the time from the entry of each component to the end of the motion [s]. Shape (K,)."""
        return self._along_the_chain(self.durations_s, self.model.terminal)

    def _along_the_chain(self, each: Array, ends: NDArray[np.bool_]) -> Array:
        """Sum a number per component along the chain, from each component to the chain's end. Shape (K,)."""
        sums, known = np.zeros(len(each)), np.array(ends)
        for i in range(len(each)):
            way, q = [], i
            while q >= 0 and not known[q]:
                way.append(q)
                q = int(self.successors[q])
            total = sums[q] if q >= 0 else 0.0
            for q in reversed(way):
                total += each[q]
                sums[q], known[q] = total, True
        return sums
