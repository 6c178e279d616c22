"""The HSMM's forward variable: in which component the motion will be, and how surely (Sec. III-B).

All observations equally likely (N_s,i = 1), so it predicts from durations and transitions alone. It starts
from where the execution is, not from the initial probabilities. Computed from the probabilities of
*entering* a component, which needs no array over durations per step. A terminal component is never left.

The robot does not run it: its state sequence follows the progress that it tracks, see `reproduction/progress.py`.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from farhand.common.model.kernel import kernel
from farhand.common.model.tphsmm import TPHSMM

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
    stays, leaves = np.zeros((K, n_steps + 1)), np.zeros((K, n_steps + 1))
    ended = np.zeros(K)  # what never leaves any more
    if terminal[component]:
        ended[component] = 1.0
    else:
        _dwell_on(p[component], survival[component], elapsed, stays[component], leaves[component])
    alpha = np.zeros((n_steps, K))
    entered = np.empty(K)
    for t in range(1, n_steps + 1):
        entered[:] = 0.0
        for i in range(K):
            if leaves[i, t] > 0.0:
                ended[i] += leaves[i, t] * exit_probability[i]
                for j in range(K):
                    entered[j] += leaves[i, t] * transition[i, j]
        for j in range(K):
            if terminal[j]:
                ended[j] += entered[j]
            elif entered[j] > 0.0:
                stays[j, t] += entered[j]
                _dwell(entered[j], p[j], survival[j], stays[j, t + 1 :], leaves[j, t + 1 :])
            alpha[t - 1, j] = stays[j, t] + ended[j]
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
def _dwell(entered, p, survival, stays, leaves):
    """Spread the probability of entering a component now over when it is still there, and when it leaves."""
    for d in range(min(p.size, stays.size)):
        stays[d] += entered * survival[d + 1]
        leaves[d] += entered * p[d]


@kernel
def _dwell_on(p, survival, elapsed, stays, leaves):
    """Spread the probability of the first component, which has lasted `elapsed` steps.

    Shapes (n_steps + 1,).
    """
    left = survival[elapsed]
    if left <= 0.0:  # longer than any duration: it leaves at once
        leaves[1] = 1.0
        return
    for d in range(min(p.size - elapsed, stays.size - 1)):
        stays[d + 1] = survival[elapsed + d + 1] / left
        leaves[d + 1] = p[elapsed + d] / left
