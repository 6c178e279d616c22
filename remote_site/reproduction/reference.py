"""The reference of the next N_p steps: desired positions and tracking costs Q_r (Sec. III-B).

The labels walk along the chain of components with their mean durations. The paper's reference steps from
mean to mean; here it ramps through each component as the demonstrations did (an extension), from where
they entered it to where they left it. In a terminal component it stands still.
"""

from __future__ import annotations

import numpy as np
from numba import njit

# A component that waits is held this long before the labels go on [s].
_HOLD_S = 0.5


@njit(cache=True)
def reference(component, elapsed, waiting, successors, durations, entries, exits, precisions, n_steps, dt):
    """Labels, desired positions and their cost over the horizon.

    Args:
        component: Present component.
        elapsed: Time since it was entered [s].
        waiting: Whether it is due, but its successor must not be entered yet.
        successors: Component after each, or -1. Shape (K,).
        durations: Mean durations [s]. Shape (K,).
        entries: World position at entering each component [m]. Shape (K, D).
        exits: World position at leaving it [m]. Shape (K, D).
        precisions: Its tracking cost [1/m^2]. Shape (K, D, D).
        n_steps: N_p.
        dt: Control period [s].

    Returns:
        Labels (N_p,), desired positions (N_p, D) [m] and costs (N_p, D, D) [1/m^2].
    """
    D = entries.shape[1]
    labels = np.empty(n_steps, np.int64)
    targets, costs = np.empty((n_steps, D)), np.empty((n_steps, D, D))
    q = component
    if waiting:
        elapsed = durations[q] - _HOLD_S
    for r in range(n_steps):
        elapsed += dt
        while elapsed > durations[q] and successors[q] >= 0:
            elapsed -= durations[q]
            q = successors[q]
            waiting = False
        fraction = 1.0
        if not waiting and durations[q] > 0.0:
            fraction = min(max(elapsed / durations[q], 0.0), 1.0)
        labels[r] = q
        targets[r] = entries[q] + fraction * (exits[q] - entries[q])
        costs[r] = precisions[q]
    return labels, targets, costs
