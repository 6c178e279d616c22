"""The HSMM's forward variable: in which component the motion will be, and how surely (Sec. III-B).

All observations equally likely (N_s,i = 1), so it predicts from durations and transitions alone. It starts
from where the execution is, not from the initial probabilities. Computed from the probabilities of
*entering* a component, which needs no array over durations per step. A terminal component is never left.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from common.kernel import kernel
from common.tphsmm import TPHSMM

Array = NDArray[np.float64]

# Durations up to this many standard deviations above their mean.
_TAIL = 4.0


def forward_variable(model: TPHSMM, component: int, elapsed_s: float, n_steps: int, dt: float) -> Array:
    """Probability alpha_i,t of each component at each of the next steps.

    Args:
        model: The learned task.
        component: Present component.
        elapsed_s: Time since it was entered [s].
        n_steps: Number of steps.
        dt: Their length [s].

    Returns:
        alpha; every row sums to one. Shape (n_steps, K).
    """
    p = duration_probabilities(model, dt)
    elapsed = min(round(elapsed_s / dt), p.shape[1] - 1)
    return _forward(p, model.transition, model.exit, model.terminal, component, elapsed, n_steps)


def duration_probabilities(model: TPHSMM, dt: float) -> Array:
    """N(d | mu_i^D, Sigma_i^D) over durations d of 1 to d_max steps, normalised. Shape (K, d_max)."""
    mean, deviation = model.duration_mean_s / dt, np.sqrt(model.duration_variance_s2) / dt
    d_max = max(1, math.ceil((mean + _TAIL * deviation).max()))
    return _normal(mean, deviation, d_max)


@kernel
def _normal(mean, deviation, d_max):
    """Normal densities at 1 .. d_max, normalised."""
    p = np.empty((mean.size, d_max))
    for i in range(mean.size):
        # relative to the component's likeliest duration, so that not all can vanish
        nearest = min(max(np.round(mean[i]), 1.0), float(d_max))
        least = ((nearest - mean[i]) / deviation[i]) ** 2
        total = 0.0
        for d in range(d_max):
            p[i, d] = np.exp(0.5 * (least - ((d + 1 - mean[i]) / deviation[i]) ** 2))
            total += p[i, d]
        for d in range(d_max):
            p[i, d] /= total
    return p


@kernel
def _forward(p, transition, exit_probability, terminal, component, elapsed, n_steps):
    K = p.shape[0]
    survival = _survival(p)
    entered = np.zeros((K, n_steps + 1))
    since = np.full(K, n_steps + 1)  # when a component is entered first
    ended = np.zeros(K)  # what never leaves any more
    if terminal[component]:
        ended[component] = 1.0
    alpha = np.zeros((n_steps, K))
    for t in range(1, n_steps + 1):
        for i in range(K):
            if terminal[i]:
                continue
            stays, leaves = _dwell(p[i], survival[i], entered[i], since[i], t)
            if i == component:
                more_stays, more_leaves = _first_dwell(p[i], survival[i], elapsed, t)
                stays, leaves = stays + more_stays, leaves + more_leaves
            alpha[t - 1, i] += stays
            ended[i] += leaves * exit_probability[i]
            _enter(leaves, transition[i], entered, since, t)
        for j in range(K):
            if terminal[j]:
                ended[j] += entered[j, t]
            else:
                alpha[t - 1, j] += entered[j, t]
            alpha[t - 1, j] += ended[j]
    return alpha


@kernel
def _survival(p):
    """Probability that a duration is longer than d = 0 .. d_max steps. Shape (K, d_max + 1)."""
    K, d_max = p.shape
    survival = np.zeros((K, d_max + 1))
    for i in range(K):
        for d in range(d_max - 1, -1, -1):
            survival[i, d] = survival[i, d + 1] + p[i, d]
    return survival


@kernel
def _enter(leaves, transition, entered, since, t):
    """Distribute what leaves a component now over its successors."""
    if leaves > 0.0:
        for j in range(transition.size):
            if transition[j] > 0.0:
                entered[j, t] += leaves * transition[j]
                since[j] = min(since[j], t)


@kernel
def _dwell(p, survival, entered, since, t):
    """Probabilities of being still in a component, and of leaving it now, from those of entering it."""
    stays, leaves = 0.0, 0.0
    for s in range(max(since, t - p.size), t):
        stays += entered[s] * survival[t - s]
        leaves += entered[s] * p[t - s - 1]
    return stays, leaves


@kernel
def _first_dwell(p, survival, elapsed, t):
    """The same for the component of the beginning, which had lasted for `elapsed` steps."""
    left = survival[elapsed]
    if left <= 0.0:  # longer than any duration: it leaves at once
        return 0.0, 1.0 if t == 1 else 0.0
    age = elapsed + t
    if age > p.size:
        return 0.0, 0.0
    return survival[age] / left, p[age - 1] / left
