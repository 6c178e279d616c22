"""Other ways to compute the forward variable: the recursion as printed, and vectorised numpy."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from farhand.common.model.tphsmm import TPHSMM
from farhand.evaluation.metrics.forward_variable import duration_probabilities

Array = NDArray[np.float64]


def naive(model: TPHSMM, component: int, n_steps: int, dt: float) -> Array:
    """Compute it by three nested loops over time, component and duration, from the entry of a component."""
    p = duration_probabilities(model, dt)
    K, d_max = p.shape
    survival = 1.0 - np.cumsum(p, axis=1)
    entered, alpha, ended = np.zeros((n_steps + 1, K)), np.zeros((n_steps, K)), np.zeros(K)
    entered[0, component] = 1.0
    for t in range(1, n_steps + 1):
        for i in np.flatnonzero(~model.terminal):
            stays = leaves = 0.0
            for d in range(1, min(t, d_max) + 1):
                stays += entered[t - d, i] * survival[i, d - 1]
                leaves += entered[t - d, i] * p[i, d - 1]
            alpha[t - 1, i] += stays
            ended[i] += leaves * model.exit[i]
            for j in range(K):
                entered[t, j] += leaves * model.transition[i, j]
        ended[model.terminal] += entered[t, model.terminal]
        alpha[t - 1] += np.where(model.terminal, 0.0, entered[t]) + ended
    return alpha


def vectorised(model: TPHSMM, component: int, n_steps: int, dt: float) -> Array:
    """Compute it by whole-array operations over components and durations."""
    p = duration_probabilities(model, dt)
    K, d_max = p.shape
    p = np.where(model.terminal[:, None], 0.0, p)
    survival = np.where(model.terminal[:, None], 0.0, 1.0 - np.cumsum(p, axis=1))
    backwards, stay_backwards = p[:, ::-1].T.copy(), survival[:, ::-1].T.copy()
    entered, alpha, ended = np.zeros((n_steps + d_max, K)), np.zeros((n_steps, K)), np.zeros(K)
    entered[d_max - 1, component] = 1.0
    for t in range(n_steps):
        window = entered[t : t + d_max]
        leaves = (window * backwards).sum(axis=0)
        now = leaves @ model.transition
        entered[t + d_max] = now
        ended += leaves * model.exit + np.where(model.terminal, now, 0.0)
        alpha[t] = (window * stay_backwards).sum(axis=0) + np.where(model.terminal, 0.0, now) + ended
    return alpha
