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

from common.kernel import kernel
from common.small_matrix import cholesky, solve_columns, solve_vector

Array = NDArray[np.float64]


@kernel
def solve(position, velocity, targets, precisions, control_cost, n_controls, dt):
    """Control commands that minimise Eq. 5.

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
    gains_p, gains_v, offsets = _gains(targets, precisions, control_cost, n_controls, dt)
    p, v = position.copy(), velocity.copy()
    u = np.empty((n_controls, D))
    for r in range(n_controls):
        for a in range(D):
            total = offsets[r, a]
            for b in range(D):
                total -= gains_p[r, a, b] * p[b] + gains_v[r, a, b] * v[b]
            u[r, a] = total
        for a in range(D):
            p[a] += dt * v[a] + 0.5 * dt * dt * u[r, a]
            v[a] += dt * u[r, a]
    return u


@kernel
def _gains(targets, precisions, control_cost, n_controls, dt):
    """Backward recursion: u = offset - gain_p p - gain_v v at each of the N_c steps.

    The cost to go is z^T P z - 2 s^T z with z = (p, v), P in blocks pp, pv, vv.
    """
    N_p, D = targets.shape[0], len(control_cost)
    pp, pv, vv = np.zeros((D, D)), np.zeros((D, D)), np.zeros((D, D))
    sp, sv = np.zeros(D), np.zeros(D)
    gains_p, gains_v = np.empty((n_controls, D, D)), np.empty((n_controls, D, D))
    offsets = np.empty((n_controls, D))
    gp, gv, L, h = np.empty((D, D)), np.empty((D, D)), np.empty((D, D)), np.empty(D)
    b_p, b_v = 0.5 * dt * dt, dt
    for r in range(N_p - 1, -1, -1):
        for a in range(D):  # the cost of the state that step r leads to
            for b in range(D):
                pp[a, b] += precisions[r, a, b]
                sp[a] += precisions[r, a, b] * targets[r, b]
        if r < n_controls:
            for a in range(D):
                h[a] = b_p * sp[a] + b_v * sv[a]
                for b in range(D):
                    gp[a, b] = b_p * pp[a, b] + b_v * pv[b, a]  # B^T P A, columns of p
                    mv = b_p * pv[a, b] + b_v * vv[a, b]
                    gv[a, b] = dt * gp[a, b] + mv  # B^T P A, columns of v
                    L[a, b] = b_p * gp[a, b] + b_v * mv
                L[a, a] += control_cost[a]  # B^T P B + R
            cholesky(L, D)
            solve_columns(L, gp, gains_p[r], D)
            solve_columns(L, gv, gains_v[r], D)
            solve_vector(L, h, offsets[r], D)
        _propagate(pp, pv, vv, sp, sv, dt, D)  # A^T P A, A^T s
        if r < n_controls:
            _subtract_control(pp, pv, vv, sp, sv, gp, gv, gains_p[r], gains_v[r], h, D)
    return gains_p, gains_v, offsets


@kernel
def _propagate(pp, pv, vv, sp, sv, dt, D):
    for a in range(D):
        for b in range(D):
            vv[a, b] += dt * (pv[a, b] + pv[b, a]) + dt * dt * pp[a, b]
    for a in range(D):
        sv[a] += dt * sp[a]
        for b in range(D):
            pv[a, b] += dt * pp[a, b]


@kernel
def _subtract_control(pp, pv, vv, sp, sv, gp, gv, gain_p, gain_v, h, D):
    """P -= G^T H^-1 G and s -= G^T H^-1 B^T s, kept symmetric."""
    for a in range(D):
        for c in range(D):
            sp[a] -= gain_p[c, a] * h[c]
            sv[a] -= gain_v[c, a] * h[c]
            for b in range(D):
                pv[a, b] -= gp[c, a] * gain_v[c, b]
                pp[a, b] -= 0.5 * (gp[c, a] * gain_p[c, b] + gp[c, b] * gain_p[c, a])
                vv[a, b] -= 0.5 * (gv[c, a] * gain_v[c, b] + gv[c, b] * gain_v[c, a])
