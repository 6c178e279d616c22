"""A sketch of the running demonstration, of fixed size: which phase a datapoint has is known only at the end.

Datapoints that lie within a short distance of the first of a row are averaged in it. When the rows are all
used they are joined in pairs, and the distance doubles. The sketch is erased when the demonstration ends.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from farhand.common.model.kernel import plain_kernel
from farhand.common.model.manifold import Manifold, copy_to, exp_at, log_at
from farhand.common.model.way import N_PHASES
from farhand.local_site.learning.way_statistics import WholeMotion

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

N_ROWS = 256
# Distance at first, in lambda, and in standard deviations of the sensor: whichever is more.
_SPACING, _DEVIATIONS = 0.02, 3.0
# Share of the time in the phase; the rest is length.
_TIME_SHARE = 0.2


class Sketch(NamedTuple):
    """Rows so far."""

    size: Integers  # how many rows, and how often they were joined; shape (2,)
    counts: Array  # datapoints of each row, shape (N_ROWS,)
    times: Array  # their mean times [s], shape (N_ROWS,)
    points: Array  # their mean points in each frame, shape (N_ROWS, P, C)
    first: Array  # first datapoint of the last row, seen from the goal; shape (C,)

    @classmethod
    def begin(cls, n_frames: int, space: Manifold) -> Sketch:
        """Return the state before the first datapoint."""
        C = space.n_coordinates
        return cls(
            np.zeros(2, np.int64),
            np.zeros(N_ROWS),
            np.zeros(N_ROWS),
            np.zeros((N_ROWS, n_frames, C)),
            np.zeros(C),
        )


@plain_kernel
def draw_point(sketch, point, time, max_distance, radian, noise, e):
    """Draw the next datapoint.

    Args:
        sketch: Changed in place.
        point: In each frame. Shape (P, C).
        time: [s].
        max_distance: The lambda [m].
        radian: What a radian is worth [m].
        noise: Variances of the sensor's position and rotation. Shape (2,).
        e: Room for a tangent. Shape (T,).
    """
    P, row = point.shape[0], sketch.size[0] - 1
    sensor = _DEVIATIONS * np.sqrt(noise[0] + radian * radian * noise[1])
    spacing = max(_SPACING * max_distance * 2.0 ** sketch.size[1], sensor)
    if row >= 0 and _is_near(sketch.first, point[P - 1], spacing, radian, e):
        sketch.counts[row] += 1.0
        share = 1.0 / sketch.counts[row]
        sketch.times[row] += share * (time - sketch.times[row])
        for p in range(P):
            log_at(sketch.points[row, p], point[p], e)
            for k in range(e.size):
                e[k] *= share
            exp_at(sketch.points[row, p], e, sketch.points[row, p])
        return
    if row + 1 == N_ROWS:
        _join_pairs(sketch, e)
        row = sketch.size[0] - 1
    sketch.size[0] = row + 2
    sketch.counts[row + 1] = 1.0
    sketch.times[row + 1] = time
    for p in range(P):
        copy_to(point[p], sketch.points[row + 1, p])
    copy_to(point[P - 1], sketch.first)


@plain_kernel
def _is_near(first, point, spacing, radian, e):
    """Decide whether a point is within a distance of another. Shapes (C,), (C,)."""
    log_at(first, point, e)
    square, n = 0.0, e.size if e.size == point.size else e.size - 3
    for k in range(e.size):
        square += (e[k] if k < n else radian * e[k]) ** 2
    return square < spacing * spacing


@plain_kernel
def _join_pairs(sketch, e):
    """Join the rows in pairs, weighted by their datapoints."""
    for row in range(N_ROWS // 2):
        a, b = 2 * row, 2 * row + 1
        n = sketch.counts[a] + sketch.counts[b]
        share = sketch.counts[b] / n
        for p in range(sketch.points.shape[1]):
            log_at(sketch.points[a, p], sketch.points[b, p], e)
            for k in range(e.size):
                e[k] *= share
            exp_at(sketch.points[a, p], e, sketch.points[row, p])
        sketch.times[row] = sketch.times[a] + share * (sketch.times[b] - sketch.times[a])
        sketch.counts[row] = n
    sketch.size[0] = N_ROWS // 2
    sketch.size[1] += 1


def whole_motion(
    sketch: Sketch,
    start: tuple[Array, float],
    end: tuple[Array, float],
    terminal: int,
    space: Manifold,
    radian: float,
) -> WholeMotion | None:
    """Return the demonstration at equal phases; None when it took no time.

    Args:
        sketch: Of the demonstration.
        start: Where it began in each frame (P, C), and when [s].
        end: Where and when it ended.
        terminal: The component in which it ended.
        space: Of the points.
        radian: What a radian is worth [m].
    """
    rows = int(sketch.size[0])
    points = np.concatenate([start[0][None], sketch.points[:rows], end[0][None]])
    times = np.concatenate([[start[1]], sketch.times[:rows], [end[1]]])
    duration_s = end[1] - start[1]
    if duration_s <= 0.0:
        return None
    steps = space.log(points[:-1], points[1:])
    lengths = np.linalg.norm(steps[:, -1] * np.repeat([1.0, radian], [space.n_dims, space.n_tangent - space.n_dims]), axis=1)  # fmt: skip
    passed_s = np.clip(times - start[1], 0.0, duration_s) / duration_s
    way = np.concatenate([[0.0], np.cumsum(lengths)])
    phases = passed_s if way[-1] <= 0.0 else (1.0 - _TIME_SHARE) * way / way[-1] + _TIME_SHARE * passed_s
    at = np.linspace(0.0, 1.0, N_PHASES + 1)
    low = np.clip(np.searchsorted(phases, at, side="right") - 1, 0, len(steps) - 1)
    widths = np.maximum(phases[low + 1] - phases[low], 1e-12)
    share = np.clip((at - phases[low]) / widths, 0.0, 1.0)
    found = space.exp(points[low], share[:, None, None] * steps[low]).swapaxes(0, 1)
    found[:, 0], found[:, -1] = start[0], end[0]
    return WholeMotion(np.ascontiguousarray(found), np.interp(at, phases, passed_s), duration_s, terminal)
