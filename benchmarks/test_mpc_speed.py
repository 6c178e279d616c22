"""One solve of the MPC beside the dense Eq. 7 with its prediction matrices ready."""

from __future__ import annotations

import numpy as np
import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from remote_site.reproduction.mpc import solve

DT, CONTROL_COST = 0.02, 15.0


def problem(n_steps: int, n_dims: int = 3):
    random = np.random.default_rng(0)
    roots = random.normal(size=(n_steps, n_dims, n_dims))
    precisions = roots @ roots.transpose(0, 2, 1) + np.eye(n_dims)
    return (
        random.normal(size=n_dims),
        random.normal(size=n_dims),
        random.normal(size=(n_steps, n_dims)),
        precisions,
    )


class DenseMpc:
    """Eqs. 3 and 7 as printed."""

    def __init__(self, n_steps: int, n_dims: int = 3):
        eye = np.eye(n_dims)
        A = np.block([[eye, DT * eye], [0 * eye, eye]])
        B = np.vstack([0.5 * DT**2 * eye, DT * eye])
        powers = [np.eye(2 * n_dims)]
        for _ in range(n_steps):
            powers.append(A @ powers[-1])
        self.S_x = np.vstack(powers[1:])
        self.S_u = np.zeros((2 * n_dims * n_steps, n_dims * n_steps))
        for r in range(n_steps):
            for c in range(r + 1):
                rows = slice(2 * n_dims * r, 2 * n_dims * (r + 1))
                self.S_u[rows, n_dims * c : n_dims * (c + 1)] = powers[r - c] @ B
        self.n_steps, self.n_dims = n_steps, n_dims

    def solve(self, position, velocity, targets, precisions):
        D, N = self.n_dims, self.n_steps
        Q = np.zeros((2 * D * N, 2 * D * N))
        desired = np.zeros(2 * D * N)
        for r in range(N):
            Q[2 * D * r : 2 * D * r + D, 2 * D * r : 2 * D * r + D] = precisions[r]
            desired[2 * D * r : 2 * D * r + D] = targets[r]
        SQ = self.S_u.T @ Q
        error = desired - self.S_x @ np.concatenate([position, velocity])
        return np.linalg.solve(SQ @ self.S_u + CONTROL_COST * np.eye(D * N), SQ @ error).reshape(N, D)


@pytest.mark.parametrize("n_steps", [20, 50, 100])
@pytest.mark.benchmark(group="mpc")
def test_riccati_recursion(benchmark: BenchmarkFixture, n_steps: int):
    position, velocity, targets, precisions = problem(n_steps)
    u = benchmark(solve, position, velocity, targets, precisions, (CONTROL_COST,) * 3, n_steps, DT)
    expected = DenseMpc(n_steps).solve(position, velocity, targets, precisions)
    np.testing.assert_allclose(u, expected, atol=1e-8)


@pytest.mark.parametrize("n_steps", [20, 50, 100])
@pytest.mark.benchmark(group="mpc")
def test_dense_equation_7(benchmark: BenchmarkFixture, n_steps: int):
    benchmark(DenseMpc(n_steps).solve, *problem(n_steps))
