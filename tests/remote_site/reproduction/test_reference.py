from __future__ import annotations

import numpy as np

from farhand.remote_site.reproduction.reference import reference

SUCCESSORS, DURATIONS = np.array([1, 2, -1]), np.array([0.5, 0.3, 0.0])
ENTRIES = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 2.0]])
RAMPS = np.array([[1.0, 0.0], [1.0, 1.0], [0.0, 0.0]])
PRECISIONS = np.array([1.0, 2.0, 3.0])[:, None, None] * np.eye(2)


def walk(component: int = 0, elapsed: float = 0.0, waiting: bool = False, n_steps: int = 12):
    return reference(
        component, elapsed, waiting, SUCCESSORS, DURATIONS, ENTRIES, RAMPS, PRECISIONS, n_steps, 0.1
    )


def test_it_ramps_through_the_components_and_stands_still_at_the_end():
    labels, targets, costs = walk()
    assert labels.tolist() == [0] * 5 + [1] * 3 + [2] * 4
    np.testing.assert_allclose(targets[:5, 0], [0.2, 0.4, 0.6, 0.8, 1.0])
    np.testing.assert_allclose(targets[5:8, 1], [1 / 3, 2 / 3, 1.0])
    np.testing.assert_allclose(targets[8:], 2.0)
    np.testing.assert_allclose(costs, PRECISIONS[labels])


def test_it_goes_on_from_the_time_already_spent():
    whole, rest = walk(n_steps=12), walk(elapsed=0.3, n_steps=9)
    for later, earlier in zip(rest, whole, strict=True):
        np.testing.assert_allclose(later, earlier[3:], atol=1e-12)


def test_a_component_that_waits_is_held_at_its_exit_for_half_a_second():
    labels, targets, _ = walk(elapsed=0.9, waiting=True)
    assert labels[:5].tolist() == [0] * 5
    np.testing.assert_allclose(targets[:5], np.repeat([[1.0, 0.0]], 5, axis=0))
    assert labels[5] == 1


def test_the_last_component_is_held_for_ever():
    labels, targets, _ = walk(component=2, elapsed=50.0)
    assert set(labels) == {2}
    np.testing.assert_allclose(targets, 2.0)
