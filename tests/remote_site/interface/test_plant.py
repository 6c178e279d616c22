from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from farhand.remote_site.interface.plant import PointPlant

DT_S = 0.02
SPEED_M_S, ACCELERATION_M_S2 = 0.6, 4.0
MIDDLE = np.array([0.5, 0.5])

vectors = st.tuples(st.floats(-50.0, 50.0), st.floats(-50.0, 50.0)).map(np.array)
acts = st.lists(
    st.tuples(st.sampled_from(["accelerate", "follow", "brake"]), vectors), min_size=1, max_size=60
)


def a_plant(start_m: np.ndarray = MIDDLE) -> PointPlant:
    return PointPlant(start_m, np.ones(2), SPEED_M_S, ACCELERATION_M_S2)


def act(plant: PointPlant, how: str, vector: np.ndarray) -> None:
    match how:
        case "accelerate":
            plant.accelerate(vector, DT_S)
        case "follow":
            plant.follow(vector, SPEED_M_S, DT_S)
        case _:
            plant.brake(DT_S)


@settings(deadline=None, derandomize=True, max_examples=60)
@given(acts=acts)
def test_whatever_it_is_told_it_keeps_its_limits_and_its_box(acts: list):
    plant = a_plant()
    for how, vector in acts:
        before = plant.read()
        act(plant, how, vector)
        after = plant.read()
        assert (after.position_m >= 0.0).all() and (after.position_m <= 1.0).all()
        assert np.linalg.norm(after.velocity_m_s) <= SPEED_M_S + 1e-9
        free = (after.position_m > 0.0).all() and (after.position_m < 1.0).all()
        change = np.linalg.norm(after.velocity_m_s - before.velocity_m_s)
        assert not free or change <= ACCELERATION_M_S2 * DT_S + 1e-9


def test_it_is_the_double_integrator_of_equation_2():
    plant, p, v = a_plant(), MIDDLE.copy(), np.zeros(2)
    for u in np.random.default_rng(0).uniform(-1.0, 1.0, (30, 2)):
        p, v = p + DT_S * v + 0.5 * DT_S**2 * u, v + DT_S * u
        plant.accelerate(u, DT_S)
    np.testing.assert_allclose(plant.read().position_m, p, atol=1e-12)
    np.testing.assert_allclose(plant.read().velocity_m_s, v, atol=1e-12)


def test_following_ends_at_the_place_and_hardly_overshoots():
    plant, goal = a_plant(), np.array([0.9, 0.2])
    beyond = []
    for _ in range(200):
        plant.follow(goal, SPEED_M_S, DT_S)
        beyond.append((plant.read().position_m - goal) @ (goal - MIDDLE) / np.linalg.norm(goal - MIDDLE))
    np.testing.assert_allclose(plant.read().position_m, goal, atol=1e-4)
    assert max(beyond) < 0.002


def test_following_is_never_faster_than_said():
    plant = a_plant()
    for _ in range(30):
        plant.follow(np.array([1.0, 0.5]), 0.1, DT_S)
        assert np.linalg.norm(plant.read().velocity_m_s) <= 0.1 + 1e-12


def test_braking_comes_to_rest_as_soon_as_the_limit_allows_and_holds():
    plant = a_plant()
    while np.linalg.norm(plant.read().velocity_m_s) < SPEED_M_S - 1e-9:
        plant.accelerate(np.array([4.0, 0.0]), DT_S)
    for _ in range(round(SPEED_M_S / ACCELERATION_M_S2 / DT_S + 0.5)):
        plant.brake(DT_S)
    held = plant.read()
    np.testing.assert_allclose(held.velocity_m_s, 0.0, atol=1e-12)
    for _ in range(50):
        plant.brake(DT_S)
    np.testing.assert_array_equal(plant.read().position_m, held.position_m)


def test_it_stops_at_the_edge_and_can_leave_it():
    plant = a_plant()
    for _ in range(200):
        plant.accelerate(np.array([4.0, 0.0]), DT_S)
    np.testing.assert_array_equal(plant.read().position_m, [1.0, 0.5])
    assert plant.read().velocity_m_s[0] == 0.0
    for _ in range(20):
        plant.follow(MIDDLE, SPEED_M_S, DT_S)
    assert plant.read().position_m[0] < 1.0


def test_what_was_read_is_a_copy():
    plant = a_plant()
    plant.read().position_m[:] = 0.0
    np.testing.assert_array_equal(plant.read().position_m, MIDDLE)


def test_it_is_never_faster_than_its_limit_however_long_it_is_accelerated():
    plant = a_plant(np.array([0.1, 0.1]))
    for _ in range(40):
        plant.accelerate(np.array([3.0, 2.0]), DT_S)
        assert np.linalg.norm(plant.read().velocity_m_s) <= SPEED_M_S + 1e-9
    assert np.linalg.norm(plant.read().velocity_m_s) > SPEED_M_S - 1e-6
