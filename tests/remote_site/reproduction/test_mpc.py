from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from numpy.typing import NDArray

from farhand.remote_site.reproduction.mpc import solve
from tests.strategies import dims, random_covariances, seeds

DT = 0.02


def dense(p: NDArray, v: NDArray, targets: NDArray, Q: NDArray, r: float, N_c: int) -> NDArray:
    """Eqs. 3 and 7 as they are printed."""
    N_p, D = targets.shape
    one, zero = np.eye(D), np.zeros((D, D))
    A, B = np.block([[one, DT * one], [zero, one]]), np.vstack([0.5 * DT**2 * one, DT * one])
    powers = [np.linalg.matrix_power(A, k) for k in range(N_p + 1)]
    S_x = np.vstack(powers[1:])
    S_u = np.zeros((2 * D * N_p, D * N_c))
    for i in range(N_p):
        for j in range(min(i + 1, N_c)):
            S_u[2 * D * i : 2 * D * (i + 1), D * j : D * (j + 1)] = powers[i - j] @ B
    Q_all, reference = np.zeros((2 * D * N_p, 2 * D * N_p)), np.zeros(2 * D * N_p)
    for i in range(N_p):
        position = slice(2 * D * i, 2 * D * i + D)
        Q_all[position, position], reference[position] = Q[i], targets[i]
    H = S_u.T @ Q_all @ S_u + r * np.eye(D * N_c)
    return np.linalg.solve(H, S_u.T @ Q_all @ (reference - S_x @ np.concatenate([p, v]))).reshape(N_c, D)


@settings(deadline=None, derandomize=True, max_examples=20)
@given(seed=seeds, n_dims=dims)
@pytest.mark.parametrize("n_controls", [60, 30, 1])
def test_the_recursion_is_equation_7(n_controls: int, seed: int, n_dims: int):
    rng = np.random.default_rng(seed)
    p, v = rng.normal(size=(2, n_dims))
    targets, Q = rng.normal(size=(60, n_dims)), random_covariances(rng, 60, n_dims)
    r = 10.0 ** rng.uniform(-4, 2)
    expected = dense(p, v, targets, Q, r, n_controls)
    u = solve(p, v, targets, Q, (r,) * n_dims, n_controls, DT)
    np.testing.assert_allclose(u, expected, atol=1e-9 * max(1.0, np.abs(expected).max()), rtol=0.0)


def test_no_other_commands_cost_less():
    rng = np.random.default_rng(0)
    p, v = rng.normal(size=(2, 2))
    targets, Q = rng.normal(size=(40, 2)), random_covariances(rng, 40, 2)

    def cost(u: NDArray) -> float:  # Eq. 5 along the simulated motion
        at, speed, total = p, v, 0.1 * float((u**2).sum())
        for r in range(40):
            push = u[r] if r < len(u) else np.zeros(2)
            at, speed = at + DT * speed + 0.5 * DT**2 * push, speed + DT * push
            total += float((targets[r] - at) @ Q[r] @ (targets[r] - at))
        return total

    u = solve(p, v, targets, Q, (0.1, 0.1), 25, DT)
    for _ in range(50):
        assert cost(u) <= cost(u + 0.01 * rng.normal(size=u.shape))


def test_inputs_are_not_changed():
    rng = np.random.default_rng(1)
    p, v = rng.normal(size=(2, 2))
    inputs = (p, v, rng.normal(size=(10, 2)), random_covariances(rng, 10, 2))
    before = [array.copy() for array in inputs]
    solve(*inputs, (1.0, 1.0), 10, DT)
    for array, old in zip(inputs, before, strict=True):
        np.testing.assert_array_equal(array, old)
