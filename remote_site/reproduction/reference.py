"""Reference of the next N_p steps: desired points and tracking costs Q_r (Sec. III-B).

The labels walk along the chain of components with their mean durations. The paper's reference steps from mean
to mean; here it ramps through each component as the demonstrations did (an extension), from where they
entered it to where they left it. In a terminal component it stands still.
"""

from __future__ import annotations

import numpy as np

from farhand.common.model.kernel import kernel
from farhand.common.model.manifold import exp_at, log_at, right_jacobian
from farhand.common.model.small_matrix import transform

# A component that waits is held this long before the labels go on [s].
_HOLD_S = 0.5


@kernel
def reference(component, elapsed, waiting, successors, durations, entries, ramps, precisions, n_steps, dt):
    """Return labels, desired points and their cost over the horizon.

    Args:
        component: Present component.
        elapsed: Time since it was entered [s].
        waiting: Whether it is due, but its successor must not be entered yet.
        successors: Component after each, or -1. Shape (K,).
        durations: Mean durations [s]. Shape (K,).
        entries: Where each component is entered, in the world [m]. Shape (K, C).
        ramps: The tangent from there to where it is left [m, rad]. Shape (K, T).
        precisions: Its tracking cost [1/m^2, 1/rad^2]. Shape (K, T, T).
        n_steps: N_p.
        dt: Control period [s].

    Returns:
        Labels (N_p,), desired points (N_p, C) and costs (N_p, T, T).
    """
    C, T = entries.shape[1], ramps.shape[1]
    labels, step = np.empty(n_steps, np.int64), np.empty(T)
    targets, costs = np.empty((n_steps, C)), np.empty((n_steps, T, T))
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
        for k in range(T):
            step[k] = fraction * ramps[q, k]
        exp_at(entries[q], step, targets[r])
        costs[r] = precisions[q]
    return labels, targets, costs


@kernel
def seen_from(point, targets, costs):
    """Return the reference in the tangent space of a point, where the robot is a double integrator at zero.

    The cost of missing a target is a quadratic form in its own axes; in those of the point it is J^T Q J,
    with J the right Jacobian of the rotation to the target. A rotation that passes half a turn goes on beyond
    it, so that the reference has no jump.

    Args:
        point: The present position or pose. Shape (C,).
        targets: Desired points. Shape (N_p, C).
        costs: Their costs. Shape (N_p, T, T).

    Returns:
        Tangents to the targets (N_p, T) and their costs (N_p, T, T).
    """
    N_p, T = targets.shape[0], costs.shape[1]
    tangents, seen = np.empty((N_p, T)), costs.copy()
    J, QJ = np.empty((3, 3)), np.empty((T, 3))
    for r in range(N_p):
        log_at(point, targets[r], tangents[r])
        if point.size == T:
            continue
        v = tangents[r, T - 3 :]
        if r > 0:
            _unwrap(v, tangents[r - 1, T - 3 :])
        right_jacobian(v, J)
        transform(seen[r], J, QJ)
    return tangents, seen


@kernel
def _unwrap(v, previous):
    """Return the same rotation as v, nearer to the previous one."""
    square = v[0] * v[0] + v[1] * v[1] + v[2] * v[2]
    along = v[0] * previous[0] + v[1] * previous[1] + v[2] * previous[2]
    if along < 0.0 and square > 0.0:
        angle = np.sqrt(square)
        other = 1.0 - 2.0 * np.pi / angle  # |other v - p|^2 < |v - p|^2
        if (other * other - 1.0) * square < 2.0 * (other - 1.0) * along:
            for k in range(3):
                v[k] *= other
