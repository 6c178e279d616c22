"""Model predictive control of a unit-mass double integrator (Sec. III-B, Eqs. 2-7).

Eq. 7 is solved exactly, not by its dense matrices but by the equivalent Riccati recursion, whose work
grows with N_p and not with its cube. Beyond the N_c control commands the input is zero, as in Eq. 3. The
cost Q_r is on the position alone; the exact zero-order hold of the input is

    p' = p + dt v + dt^2/2 u,    v' = v + dt u.

A pose is six such integrators in the tangent space of where the robot is, see `reference.seen_from`.

The dimension D is the length of a tuple, which the compiler knows: it unrolls the small loops.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from farhand.common.model.kernel import kernel
from farhand.common.model.small_matrix import cholesky, forward_columns, forward_vector

Array = NDArray[np.float64]


@kernel
def solve(position, velocity, targets, precisions, control_cost, n_controls, dt):
    """Return the control commands that minimise Eq. 5.

    Args:
        position: Present position [m], or for poses the present tangent [m, rad]. Shape (D,).
        velocity: Present velocity [m/s, rad/s]. Shape (D,).
        targets: Desired positions of the next N_p steps. Shape (N_p, D).
        precisions: Their tracking cost Q_r [1/m^2, 1/rad^2], symmetric. Shape (N_p, D, D).
        control_cost: Diagonal of R [1/(m/s^2)^2, 1/(rad/s^2)^2], a tuple of D numbers.
        n_controls: Number of control commands N_c, from 1 to N_p.
        dt: Control period [s].

    Returns:
        The commands u [m/s^2, rad/s^2]. Shape (N_c, D).
    """
    D = len(control_cost)
    L, W_p, W_v, w = _factors(targets, precisions, control_cost, n_controls, dt)
    p, v = position.copy(), velocity.copy()
    u = np.empty((n_controls, D))
    for r in range(n_controls):  # L^T u = w - W_p p - W_v v
        for a in range(D - 1, -1, -1):
            total = w[r, a]
            for b in range(D):
                total -= W_p[r, a, b] * p[b] + W_v[r, a, b] * v[b]
            for b in range(a + 1, D):
                total -= L[r, b, a] * u[r, b]
            u[r, a] = total * L[r, a, a]
        for a in range(D):
            p[a] += dt * v[a] + 0.5 * dt * dt * u[r, a]
            v[a] += dt * u[r, a]
    return u


@kernel
def _factors(targets, precisions, control_cost, n_controls, dt):
    """Backward recursion over the cost to go, z^T P z - 2 s^T z with z = (p, v), P in blocks pp, pv, vv.

    With H = B^T P B + R = L L^T the best command is H^-1 (B^T s - B^T P A z). Only W = L^-1 B^T P A and
    w = L^-1 B^T s are formed: the recursion needs W^T W, which is symmetric to the last bit. Of pp and vv
    only the lower triangles are kept.

    Returns:
        L with the inverse of its diagonal (N_c, D, D), W in blocks (N_c, D, D) twice, and w (N_c, D).
    """
    N_p, D = targets.shape[0], len(control_cost)
    pp, pv, vv = np.zeros((D, D)), np.zeros((D, D)), np.zeros((D, D))
    sp, sv = np.zeros(D), np.zeros(D)
    L, w = np.empty((n_controls, D, D)), np.empty((n_controls, D))
    W_p, W_v = np.empty((n_controls, D, D)), np.empty((n_controls, D, D))
    for r in range(N_p - 1, -1, -1):
        for a in range(D):  # the cost of the state that step r leads to
            for b in range(D):
                sp[a] += precisions[r, a, b] * targets[r, b]
            for b in range(a + 1):
                pp[a, b] += precisions[r, a, b]
        if r < n_controls:
            _factor(pp, pv, vv, sp, sv, control_cost, L[r], W_p[r], W_v[r], w[r], dt)
        _propagate(pp, pv, vv, sp, sv, dt, D)
        if r < n_controls:
            _subtract_control(pp, pv, vv, sp, sv, W_p[r], W_v[r], w[r], D)
    return L, W_p, W_v, w


@kernel
def _factor(pp, pv, vv, sp, sv, control_cost, L, W_p, W_v, w, dt):
    """Compute L, W and w of one step."""
    D, b_p, b_v = len(control_cost), 0.5 * dt * dt, dt
    for a in range(D):
        w[a] = b_p * sp[a] + b_v * sv[a]
        for b in range(D):
            low, high = max(a, b), min(a, b)
            gp = b_p * pp[low, high] + b_v * pv[b, a]  # B^T P A, columns of p
            mv = b_p * pv[a, b] + b_v * vv[low, high]
            W_p[a, b] = gp
            W_v[a, b] = dt * gp + mv  # B^T P A, columns of v
            L[a, b] = b_p * gp + b_v * mv
        L[a, a] += control_cost[a]
    cholesky(L, D)
    forward_columns(L, W_p, D)
    forward_columns(L, W_v, D)
    forward_vector(L, w, D)


@kernel
def _propagate(pp, pv, vv, sp, sv, dt, D):
    """Compute A^T P A and A^T s."""
    for a in range(D):
        sv[a] += dt * sp[a]
        for b in range(a + 1):
            vv[a, b] += dt * (pv[a, b] + pv[b, a]) + dt * dt * pp[a, b]
    for a in range(D):
        for b in range(D):
            pv[a, b] += dt * pp[max(a, b), min(a, b)]


@kernel
def _subtract_control(pp, pv, vv, sp, sv, W_p, W_v, w, D):
    """Subtract: P -= W^T W and s -= W^T w."""
    for c in range(D):
        for a in range(D):
            sp[a] -= W_p[c, a] * w[c]
            sv[a] -= W_v[c, a] * w[c]
            for b in range(a + 1):
                pp[a, b] -= W_p[c, a] * W_p[c, b]
                vv[a, b] -= W_v[c, a] * W_v[c, b]
            for b in range(D):
                pv[a, b] -= W_p[c, a] * W_v[c, b]
