"""Other ways to solve the same MPC: the dense Eq. 7, scipy's banded solver, and OSQP."""

from __future__ import annotations

import numpy as np
import osqp
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import solve_banded, solveh_banded

Array = NDArray[np.float64]


class DenseMpc:
    """Solver by Eqs. 3 and 7 as printed; the prediction matrices are precomputed."""

    def __init__(self, n_steps: int, n_dims: int, control_cost: float, dt: float):
        one, zero = np.eye(n_dims), np.zeros((n_dims, n_dims))
        A, B = np.block([[one, dt * one], [zero, one]]), np.vstack([0.5 * dt**2 * one, dt * one])
        powers = [np.linalg.matrix_power(A, k) for k in range(n_steps + 1)]
        self._S_x = np.vstack(powers[1:])
        self._S_u = np.zeros((2 * n_dims * n_steps, n_dims * n_steps))
        for i in range(n_steps):
            for j in range(i + 1):
                rows = slice(2 * n_dims * i, 2 * n_dims * (i + 1))
                self._S_u[rows, n_dims * j : n_dims * (j + 1)] = powers[i - j] @ B
        self._shape, self._R = (n_steps, n_dims), control_cost * np.eye(n_dims * n_steps)

    def solve(self, position: Array, velocity: Array, targets: Array, precisions: Array) -> Array:
        N, D = self._shape
        SQ = np.zeros_like(self._S_u.T)
        desired = np.zeros(2 * D * N)
        for r in range(N):
            at = slice(2 * D * r, 2 * D * r + D)
            SQ[:, at] = self._S_u[at].T @ precisions[r]
            desired[at] = targets[r]
        error = desired - self._S_x @ np.concatenate([position, velocity])
        return np.asarray(np.linalg.solve(SQ @ self._S_u + self._R, SQ @ error), dtype=float).reshape(N, D)


class BandedMpc:
    """Solver by `scipy.linalg.solve_banded` over states and multipliers, block by block in time.

    With the commands eliminated, u = R^-1 B^T l, the equations of x_1, l_1, x_2, ... have 4 D - 1 bands on
    each side. Everything but the precisions is filled in beforehand.
    """

    def __init__(self, n_steps: int, n_dims: int, control_cost: float, dt: float):
        D, N = n_dims, n_steps
        self._shape, self._width = (N, D), 4 * D - 1
        one, zero = np.eye(D), np.zeros((D, D))
        self._A = np.block([[one, dt * one], [zero, one]])
        self._B = np.vstack([0.5 * dt**2 * one, dt * one])
        self._gain = self._B.T / control_cost
        matrix = np.zeros((4 * D * N, 4 * D * N))
        for r in range(N):  # rows: x_r+1 = A x_r + B u_r, then the gradient of x_r+1
            dual, state = slice(4 * D * r, 4 * D * r + 2 * D), slice(4 * D * r + 2 * D, 4 * D * (r + 1))
            matrix[dual, dual] = -self._B @ self._gain
            matrix[dual, state] = matrix[state, dual] = np.eye(2 * D)
            if r > 0:
                before = slice(4 * D * r - 2 * D, 4 * D * r)
                matrix[dual, before], matrix[before, dual] = -self._A, -self._A.T
        rows, columns = np.nonzero(matrix)
        self._bands = np.zeros((2 * self._width + 1, 4 * D * N))
        self._bands[self._width + rows - columns, columns] = matrix[rows, columns]
        r, a, b = np.meshgrid(np.arange(N), np.arange(D), np.arange(D), indexing="ij")
        at = 4 * D * r + 2 * D
        self._places = (self._width + a - b, at + b)

    def solve(self, position: Array, velocity: Array, targets: Array, precisions: Array) -> Array:
        N, D = self._shape
        bands = self._bands.copy()
        bands[self._places] = precisions
        right = np.zeros((N, 4, D))
        right[0, :2] = (self._A @ np.concatenate([position, velocity])).reshape(2, D)
        right[:, 2] = np.einsum("kde,ke->kd", precisions, targets)
        width = (self._width, self._width)
        found = solve_banded(width, bands, right.ravel(), overwrite_ab=True, check_finite=False)
        return found.reshape(N, 4 * D)[:, : 2 * D] @ self._gain.T


class SemiImplicitMpc:
    """Solver by `scipy.linalg.solveh_banded` over the positions of a semi-implicit double integrator.

    Its input is a second difference of the positions, so the normal equations have 3 D bands. The hold is not
    quite that of Eq. 2: the first command differs by some per cent, the work not at all.
    """

    def __init__(self, n_steps: int, n_dims: int, control_cost: float, dt: float):
        self._shape, self._dt, D = (n_steps, n_dims), dt, n_dims
        one = np.eye(n_steps)
        self._second = (one - 2.0 * np.eye(n_steps, k=-1) + np.eye(n_steps, k=-2)) / dt**2
        normal = control_cost * self._second.T @ self._second
        self._bands = np.zeros((2 * D + 1, n_steps * D))
        for k in range(3):
            diagonal = np.repeat(np.diag(normal, k), D)
            self._bands[2 * D - k * D, k * D :] = diagonal
        self._R = control_cost

    def solve(self, position: Array, velocity: Array, targets: Array, precisions: Array) -> Array:
        (N, D), dt = self._shape, self._dt
        bands = self._bands.copy()
        for a in range(D):
            for b in range(a, D):
                bands[2 * D - (b - a), b::D] += precisions[:, a, b]
        free = np.zeros((N, D))  # contribution of the past to the second differences
        free[0], free[1] = -position / dt**2 - velocity / dt, position / dt**2
        right = np.einsum("kde,ke->kd", precisions, targets) - self._R * self._second.T @ free
        path = solveh_banded(bands, right.ravel(), overwrite_ab=True, check_finite=False).reshape(N, D)
        return self._second @ path + free


class OsqpMpc:
    """Solver by OSQP to 1e-6.

    Each call replaces its matrices' values, keeps their structure, and starts warm.
    """

    def __init__(self, n_steps: int, n_dims: int, control_cost: float, dt: float, precisions: Array):
        self._shape, D = (n_steps, n_dims), n_dims
        one = sparse.eye_array(D)
        A = sparse.block_array([[one, dt * one], [None, one]])
        B = sparse.vstack([0.5 * dt**2 * one, dt * one])
        shift = sparse.eye_array(n_steps, k=-1)
        states = sparse.eye_array(2 * D * n_steps) - sparse.kron(shift, A)
        self._equality = sparse.csc_matrix(
            sparse.hstack([states, -sparse.kron(sparse.eye_array(n_steps), B)])
        )
        self._A, self._control_cost = A.toarray(), control_cost
        P = sparse.csc_matrix(sparse.triu(self._quadratic(precisions)))
        P.eliminate_zeros()
        self._places = np.arange(P.nnz)
        zero = np.zeros(2 * D * n_steps)
        self._solver = osqp.OSQP()
        settings = {"verbose": False, "eps_abs": 1e-6, "eps_rel": 1e-6, "max_iter": 10000, "polishing": False}
        self._solver.setup(P, np.zeros(3 * D * n_steps), self._equality, zero, zero, **settings)

    def _quadratic(self, precisions: Array) -> sparse.csc_array:
        N, D = self._shape
        dense = [np.block([[Q, np.zeros((D, D))], [np.zeros((D, D)), np.zeros((D, D))]]) for Q in precisions]
        return sparse.block_diag([*dense, self._control_cost * sparse.eye_array(N * D)]).tocsc()

    def solve(self, position: Array, velocity: Array, targets: Array, precisions: Array) -> Array:
        N, D = self._shape
        rows, columns = np.triu_indices(D)
        order = np.lexsort((rows, columns))
        values = precisions[:, rows[order], columns[order]].ravel()
        q = np.zeros((N, 2, D))
        q[:, 0] = -np.einsum("kde,ke->kd", precisions, targets)
        right = np.zeros(2 * D * N)
        right[: 2 * D] = self._A @ np.concatenate([position, velocity])
        cost = np.concatenate([values, np.full(N * D, self._control_cost)])
        linear = np.concatenate([q.ravel(), np.zeros(N * D)])
        self._solver.update(q=linear, l=right, u=right, Px=cost, Px_idx=self._places)
        return np.asarray(self._solver.solve().x)[2 * D * N :].reshape(N, D)
