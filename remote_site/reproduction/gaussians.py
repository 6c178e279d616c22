"""Components in the world at one instant, and distances to them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from farhand.common.model.gaussian_product import inverse
from farhand.common.model.kernel import kernel
from farhand.common.model.manifold import Manifold, log_at

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Gaussians:
    """Components in the world at one instant.

    A pose is as far away as the worse of its two parts, position and rotation, so that the gates mean the
    same in every space.

    Args:
        space: Positions or poses.
        means: Shape (K, C).
        precisions: Inverse covariances. Shape (K, T, T).
        part_precisions: The inverses of position's and rotation's own covariances. Shape (K, T, T).
        entries: Where the demonstrations entered each component. Shape (K, C).
        exits: Where they left it. Shape (K, C).
        way_precisions: Precisions about the way between these. Shape (K, T, T).
        see: Fills in components that were not asked for yet, by their numbers; all of them when given none.
    """

    space: Manifold
    means: Array
    precisions: Array
    part_precisions: Array
    entries: Array
    exits: Array
    way_precisions: Array
    see: Callable[[Integers | None], None] = lambda which: None

    @classmethod
    def of(
        cls,
        means: Array,
        covariances: Array,
        entries: Array | None = None,
        exits: Array | None = None,
        way_precisions: Array | None = None,
    ) -> Gaussians:
        """Return the components from means (K, C) and covariances (K, T, T).

        Without a way each stands at its mean.
        """
        space, precisions = Manifold.of(means.shape[1], covariances.shape[2]), inverse(covariances)
        parts = np.zeros_like(covariances)
        for part in space.parts:
            parts[:, part, part] = inverse(covariances[:, part, part])
        return cls(
            space,
            means,
            precisions,
            parts,
            means if entries is None else entries,
            means if exits is None else exits,
            precisions if way_precisions is None else way_precisions,
        )

    def distance(self, component: int, point: Array) -> float:
        """Return the Mahalanobis distance of a point to one component."""
        return _distance(self.means, self.part_precisions, component, point)

    def lateral_distance(self, component: int, origin: int, point: Array) -> float:
        """Return the same distance without the part along the way from another component."""
        return _lateral_distance(self.means, self.part_precisions, component, origin, point)

    def length(self, component: int, tangent: Array) -> float:
        """Return the length of a tangent in standard deviations of one component, of its worse part."""
        return _length(self.part_precisions[component], tangent, self.space.n_coordinates)

    def distance_to_exit(self, component: int, point: Array) -> float:
        """Return the Mahalanobis distance to where the demonstrations left a component."""
        return _distance(self.exits, self.way_precisions, component, point)

    def is_behind_way(self, component: int, fraction: float, point: Array, gate: float) -> bool:
        """Decide whether a point is behind the demonstrations after a fraction of a component.

        Args:
            component: Which one.
            fraction: Of its duration.
            point: Position or pose. Shape (C,).
            gate: How far away from there, in standard deviations about the way.
        """
        return _is_behind_way(self.entries, self.exits, self.way_precisions, component, fraction, point, gate)

    def distance_to_way(self, component: int, following: int, point: Array) -> float:
        """Mahalanobis distance to the way through a component and on to the entry of the following one."""
        corners = [self.entries[component], self.exits[component]]
        if following >= 0:
            corners.append(self.entries[following])
        way, e = (self.space.log(self.means[component], x) for x in (np.stack(corners), point))
        P = self.part_precisions[component]
        return max(_distance_to_polyline(way[:, s], e[s], P[s, s]) for s in self.space.parts)

    def is_behind(self, component: int, end: int, point: Array, gate: float) -> bool:
        """Decide whether a point is right behind an end, along the way of the component that leads there.

        Args:
            component: The last one before the end.
            end: A terminal component.
            point: Position or pose. Shape (C,).
            gate: How far behind, in standard deviations of the end.
        """
        D = self.space.n_dims
        along = (self.means[end] - self.entries[component])[:D]
        e = (point - self.means[end])[:D]
        behind = along @ e
        deviation = np.sqrt(along @ inverse(self.precisions[end])[:D, :D] @ along)
        return bool(behind > gate * deviation and 2.0 * behind**2 > (along @ along) * (e @ e))

    def most_likely(self, point: Array, among: NDArray[np.bool_]) -> int:
        """Return the component of highest likelihood at a point. The choice has shape (K,)."""
        e = self.space.log(self.means, point)
        mahalanobis = np.einsum("kd,kde,ke->k", e, self.precisions, e)
        surprise = mahalanobis - np.linalg.slogdet(self.precisions)[1]
        return int(np.argmin(np.where(among, surprise, np.inf)))


def _distance_to_polyline(corners: Array, point: Array, precision: Array) -> float:
    """Return the least Mahalanobis distance of a point to a polyline. Shapes (N, n), (n,), (n, n)."""
    best = np.inf
    for a, b in pairwise(corners):
        way, e = b - a, point - a
        square = way @ precision @ way
        part = min(max((way @ precision @ e) / square, 0.0), 1.0) if square > 0.0 else 0.0
        e = e - part * way
        best = min(best, e @ precision @ e)
    return float(np.sqrt(best))


@kernel
def _distance(means, precisions, component, point):
    e = np.empty(precisions.shape[1])
    log_at(means[component], point, e)
    return _length(precisions[component], e, point.size)


@kernel
def _is_behind_way(entries, exits, precisions, component, fraction, point, gate):
    """Decide whether a point is behind along the way, and outside the gate about where it should be."""
    T = precisions.shape[1]
    ramp, e = np.empty(T), np.empty(T)
    log_at(entries[component], exits[component], ramp)
    log_at(entries[component], point, e)
    along = 0.0
    n = T if point.size == T else T - 3
    for k in range(T):
        e[k] -= fraction * ramp[k]
        if k < n:
            along += ramp[k] * e[k]
    return along < 0.0 and _length(precisions[component], e, point.size) > gate


@kernel
def _lateral_distance(means, precisions, component, origin, point):
    T = precisions.shape[1]
    e, along = np.empty(T), np.empty(T)
    log_at(means[component], point, e)
    log_at(means[component], means[origin], along)
    n = T if point.size == T else T - 3
    for first, last in ((0, n), (n, T)):
        square = share = 0.0
        for k in range(first, last):
            square += along[k] * along[k]
            share += along[k] * e[k]
        if square > 0.0:
            for k in range(first, last):
                e[k] -= along[k] * (share / square)
    return _length(precisions[component], e, point.size)


@kernel
def _length(P, e, n_coordinates):
    """Return the longer part of a tangent, each measured by its own block of a precision."""
    T = e.size
    n = T if n_coordinates == T else T - 3
    worst = 0.0
    for first, last in ((0, n), (n, T)):
        square = 0.0
        for a in range(first, last):
            for b in range(first, last):
                square += e[a] * P[a, b] * e[b]
        worst = max(worst, square)
    return np.sqrt(worst)
