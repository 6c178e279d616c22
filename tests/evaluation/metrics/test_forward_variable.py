from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from farhand.common.model.tphsmm import TPHSMM
from farhand.evaluation.metrics.forward_variable import duration_probabilities, forward_variable
from tests.strategies import learned

DT = 0.02


def naive(model: TPHSMM, component: int, elapsed: int, n_steps: int) -> NDArray:
    """Belief over component and age, moved step by step with the hazard of the durations."""
    p = duration_probabilities(model, DT)
    K, d_max = p.shape
    belief, ended, rows = {(component, min(elapsed, d_max - 1)): 1.0}, np.zeros(K), []
    for _ in range(n_steps):
        following: dict[tuple[int, int], float] = {}
        for (i, age), weight in belief.items():
            survival = sum(p[i, age:])
            hazard = (
                0.0 if model.terminal[i] else (p[i, age] / survival if age < d_max and survival > 0 else 1.0)
            )
            if hazard < 1.0:
                older = (i, age if model.terminal[i] else age + 1)
                following[older] = following.get(older, 0.0) + weight * (1.0 - hazard)
            ended[i] += weight * hazard * model.exit[i]
            for j in np.flatnonzero(model.transition[i]).tolist():
                following[j, 0] = following.get((j, 0), 0.0) + weight * hazard * model.transition[i, j]
        belief, row = following, ended.copy()
        for (i, _), weight in belief.items():
            row[i] += weight
        rows.append(row)
    return np.array(rows)


@settings(deadline=None, derandomize=True, max_examples=12)
@given(seed=st.integers(0, 50), component=st.integers(0, 8), elapsed=st.sampled_from([0, 3, 20, 500]))
def test_it_equals_the_naive_recursion(seed: int, component: int, elapsed: int):
    model = learned(seed=seed)
    component %= model.n_components
    alpha = forward_variable(model, component, DT * elapsed, 60, DT)
    np.testing.assert_allclose(alpha, naive(model, component, elapsed, 60), atol=1e-12)
    np.testing.assert_allclose(alpha.sum(axis=1), 1.0, atol=1e-12)


def test_the_motion_ends_in_a_terminal_component_and_stays():
    model = learned()
    alpha = forward_variable(model, int(np.argmax(model.initial)), 0.0, 1000, DT)
    assert alpha[-1, model.terminal].sum() > 0.999  # chains that turn back are left but slowly
    assert (np.diff(alpha[:, model.terminal].sum(axis=1)) >= -1e-12).all()


def test_durations_are_normalised_and_have_the_learned_mean():
    model = learned()
    p = duration_probabilities(model, 0.001)
    np.testing.assert_allclose(p.sum(axis=1), 1.0, atol=1e-12)
    mean = p @ (0.001 * np.arange(1, p.shape[1] + 1))
    sure = model.duration_mean_s > 4.0 * np.sqrt(model.duration_variance_s2)  # not cut off at zero
    assert sure.sum() > 3
    np.testing.assert_allclose(mean[sure], model.duration_mean_s[sure], rtol=0.01)
