"""Transitions and durations of the components (Algorithm 1, temporal part).

A segment is a stay in one component. It is closed, and counted, when the next component is entered and
when the demonstration ends. Durations are seconds: a datapoint owns the time since the one before it. Time for which
the hand rested is part of a duration, but has no say in where a motion goes on and how far it has come.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from farhand.common.model.kernel import kernel, plain_kernel

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


class Dwell(NamedTuple):
    """Counts and running duration statistics; arrays have room for more components than there are."""

    starts: Integers  # c0_i, demonstrations that began in i, shape (capacity,)
    ends: Integers  # cE_i, demonstrations that ended after i, shape (capacity,)
    transitions: Integers  # c_il, shape (capacity, capacity)
    stayed_s: (
        Array  # time spent in i before each transition to l, without rests [s], shape (capacity, capacity)
    )
    visits: Integers  # N_i^D, closed segments, shape (capacity,)
    mean: Array  # running mean of the duration [s], shape (capacity,)
    m2: Array  # running squared deviation of the duration [s^2], shape (capacity,)
    rested_s: Array  # time for which the hand rested in i [s], shape (capacity,)
    phase_sum: Array  # of t / T over the datapoints of ended demonstrations, shape (capacity,)
    phase_count: Integers  # these datapoints, shape (capacity,)

    @classmethod
    def empty(cls, capacity: int) -> Dwell:
        """Return empty counts."""
        starts, ends, visits, phase_count = np.zeros((4, capacity), np.int64)
        mean, m2, rested_s, phase_sum = np.zeros((4, capacity))
        transitions, stayed_s = np.zeros((capacity, capacity), np.int64), np.zeros((capacity, capacity))
        return cls(starts, ends, transitions, stayed_s, visits, mean, m2, rested_s, phase_sum, phase_count)


class Segment(NamedTuple):
    """Running demonstration and its open segment."""

    component: Integers  # or -1 before the first datapoint, shape (1,)
    clock: (
        Array  # start of the demonstration, last datapoint, start of the segment, rests in it [s], shape (4,)
    )
    time_sum: Array  # sum of t over the datapoints of each component, shape (capacity,)
    time_count: Integers  # these datapoints, shape (capacity,)

    @classmethod
    def begin(cls, capacity: int) -> Segment:
        """Return the state before the first datapoint."""
        return cls(np.array([-1]), np.zeros(4), np.zeros(capacity), np.zeros(capacity, np.int64))


@plain_kernel
def follow(dwell, segment, labels, times, rests):
    """Count along the components of consecutive datapoints, in place. Shapes (T,), (T,), (T,)."""
    for t in range(labels.size):
        q, previous = labels[t], segment.component[0]
        if previous < 0:
            dwell.starts[q] += 1
            segment.clock[:3] = times[t]
        elif q != previous:
            _close(dwell, segment, q)
            segment.clock[2] = segment.clock[1]
            segment.clock[3] = 0.0
        segment.component[0] = q
        if rests[t]:
            segment.clock[3] += times[t] - segment.clock[1]
        segment.clock[1] = times[t]
        if rests[t]:
            continue
        segment.time_sum[q] += times[t] - segment.clock[0]
        segment.time_count[q] += 1


@kernel
def finish(dwell, segment, terminal):
    """Close the last segment into the terminal component, and commit the phases."""
    _close(dwell, segment, terminal)
    dwell.ends[terminal] += 1
    total = segment.clock[1] - segment.clock[0]
    for i in range(segment.time_count.size):
        if segment.time_count[i] > 0:
            dwell.phase_sum[i] += segment.time_sum[i] / total if total > 0.0 else 0.0
            dwell.phase_count[i] += segment.time_count[i]
    dwell.phase_sum[terminal] += 1.0
    dwell.phase_count[terminal] += 1


@plain_kernel
def _close(dwell, segment, following):
    """Count the transition, and update mean and variance of the duration (Welford)."""
    i, d = segment.component[0], segment.clock[1] - segment.clock[2]
    dwell.transitions[i, following] += 1
    dwell.stayed_s[i, following] += d - segment.clock[3]
    dwell.rested_s[i] += segment.clock[3]
    dwell.visits[i] += 1
    deviation = d - dwell.mean[i]
    dwell.mean[i] += deviation / dwell.visits[i]
    dwell.m2[i] += deviation * (d - dwell.mean[i])


def moving_shares(dwell: Dwell, size: int) -> Array:
    """Share of the time in each component for which the hand did not rest; one where none was closed. Shape (K,)."""
    total_s = dwell.mean[:size] * dwell.visits[:size]
    return np.where(total_s > 0.0, 1.0 - dwell.rested_s[:size] / np.where(total_s > 0.0, total_s, 1.0), 1.0)


def duration_variance(dwell: Dwell, size: int, relative_floor: float, floor_s: float) -> Array:
    """Return the variance Sigma_i^D [s^2], floored: most components of a small model were visited once.

    Shape (K,).
    """
    visits, mean = dwell.visits[:size], dwell.mean[:size]
    sample = np.where(visits > 1, dwell.m2[:size] / np.maximum(visits - 1, 1), 0.0)
    return np.maximum(sample, (relative_floor * mean) ** 2 + floor_s**2)


def transition_probabilities(dwell: Dwell, size: int) -> tuple[Array, Array]:
    """Return transition (K, K) and exit (K,) probabilities; a component that nobody has left yet exits."""
    counts = dwell.transitions[:size, :size].astype(float)
    ends = dwell.ends[:size].astype(float)
    ends[counts.sum(axis=1) + ends == 0] = 1.0
    total = counts.sum(axis=1) + ends
    return counts / total[:, None], ends / total


def time_shares(dwell: Dwell, size: int) -> Array:
    """Return the share of the time in each component before each transition; zeros for none. Shape (K, K)."""
    stayed_s = dwell.stayed_s[:size, :size]
    total_s = stayed_s.sum(axis=1, keepdims=True)
    return stayed_s / np.where(total_s > 0.0, total_s, 1.0)
