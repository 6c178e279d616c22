"""The HSMM's forward variable: in which component the motion will be, and how surely (Sec. III-B).

All observations equally likely (N_s,i = 1), so it predicts from durations and transitions alone. It starts
from where the execution is, not from the initial probabilities. Computed from the probabilities of
*entering* a component, which needs no array over durations per step. A terminal component is never left.
"""

from __future__ import annotations

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
    return _forward(
        p, _survival(p), model.transition, model.exit, model.terminal, component, elapsed, n_steps
    )


def duration_probabilities(model: TPHSMM, dt: float) -> Array:
    """N(d | mu_i^D, Sigma_i^D) over durations d of 1 to d_max steps, normalised. Shape (K, d_max)."""
    mean, deviation = model.duration_mean_s / dt, np.sqrt(model.duration_variance_s2) / dt
    d_max = max(1, int(np.ceil((mean + _TAIL * deviation).max())))
    z = (np.arange(1, d_max + 1) - mean[:, None]) / deviation[:, None]
    # relative to each component's likeliest duration, so that not all can vanish
    weights = np.exp(-0.5 * (z**2 - (z**2).min(axis=1, keepdims=True)))
    return weights / weights.sum(axis=1, keepdims=True)


def _survival(p: Array) -> Array:
    """Probability that a duration is longer than d = 0 .. d_max steps. Shape (K, d_max + 1)."""
    tail = np.cumsum(p[:, ::-1], axis=1)[:, ::-1]
    return np.hstack([np.ones((len(p), 1)), tail[:, 1:], np.zeros((len(p), 1))])


@kernel
def _forward(p, survival, transition, exit_probability, terminal, component, elapsed, n_steps):
    K = p.shape[0]
    entered = np.zeros((n_steps + 1, K))
    ended = np.zeros(K)  # what never leaves any more
    if terminal[component]:
        ended[component] = 1.0
    alpha = np.zeros((n_steps, K))
    for t in range(1, n_steps + 1):
        for i in range(K):
            if terminal[i]:
                continue
            stays, leaves = _dwell(p[i], survival[i], entered[:t, i])
            if i == component:
                more_stays, more_leaves = _first_dwell(p[i], survival[i], elapsed, t)
                stays, leaves = stays + more_stays, leaves + more_leaves
            alpha[t - 1, i] += stays
            ended[i] += leaves * exit_probability[i]
            for j in range(K):
                entered[t, j] += leaves * transition[i, j]
        for j in range(K):
            if terminal[j]:
                ended[j] += entered[t, j]
            else:
                alpha[t - 1, j] += entered[t, j]
            alpha[t - 1, j] += ended[j]
    return alpha


@kernel
def _dwell(p, survival, entered):
    """Probabilities of being still in a component, and of leaving it now, from those of entering it."""
    stays, leaves, t = 0.0, 0.0, entered.size
    for d in range(1, min(t, p.size + 1)):
        stays += entered[t - d] * survival[d]
        leaves += entered[t - d] * p[d - 1]
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
