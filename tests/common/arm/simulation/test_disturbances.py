from __future__ import annotations

import numpy as np
import pytest

from farhand.common.arm.simulation.disturbances import (
    CALM,
    PRESETS,
    ROUGH,
    TYPICAL,
    Disturbances,
    DisturbanceSettings,
    Sway,
)
from farhand.common.errors import InvalidConfiguration

TIMES = np.arange(0.0, 40.0, 0.01)


def test_in_the_calm_nothing_happens():
    calm = Disturbances(CALM, 3)
    for happening in (calm.receptacle, calm.vehicle, calm.current_m_s, calm.push_n):
        assert not np.any([happening(t) for t in TIMES[::50]])


@pytest.mark.parametrize("seed", range(3))
def test_the_receptacle_sways_by_its_amplitude_with_its_period(seed: int):
    moved = np.array([Disturbances(TYPICAL, seed).receptacle(t) for t in TIMES])[:, :3]
    assert np.linalg.norm(moved, axis=1).max() == pytest.approx(0.020, rel=1e-4)
    np.testing.assert_allclose(moved[:1000], moved[1000:2000], atol=1e-12)
    assert np.linalg.matrix_rank(moved, tol=1e-9) == 1


def test_the_vehicle_sways_by_itself():
    swaying = Disturbances(DisturbanceSettings(vehicle=Sway(0.03, 0.2, 0.05)), 1)
    moved = np.array([swaying.vehicle(t) for t in TIMES])
    assert np.linalg.norm(moved[:, :3], axis=1).max() == pytest.approx(0.03, rel=1e-3)
    assert np.linalg.norm(moved[:, 3:], axis=1).max() == pytest.approx(0.05, rel=1e-3)
    assert not np.any([swaying.receptacle(t) for t in TIMES[::50]])


def test_a_step_is_smooth_takes_its_time_and_stays():
    step = Disturbances(DisturbanceSettings(step_m=0.05, step_at_s=4.0), 2)
    moved = np.array([np.linalg.norm(step.receptacle(t)) for t in TIMES])
    assert not moved[TIMES <= 4.0].any()
    np.testing.assert_allclose(moved[TIMES >= 4.3], 0.05)
    assert np.abs(np.diff(moved)).max() <= 1.875 * 0.05 / 0.3 * 0.01  # of a minimum-jerk stroke


@pytest.mark.parametrize("seed", range(8))
def test_a_step_and_a_push_come_before_the_robot_is_usually_inserted(seed: int):
    rough = Disturbances(DisturbanceSettings(step_m=0.05, push_n=20.0), seed)
    early = TIMES[TIMES < 8.0]
    moved = np.array([np.linalg.norm(rough.receptacle(t)) for t in early])
    pushed = np.array([np.linalg.norm(rough.push_n(t)) for t in early])
    moving = early[(moved > 0.0) & (moved < 0.0499)]
    assert moving[0] >= 3.0 and moving[-1] <= 6.3
    assert early[pushed > 0.0][0] >= 2.0 and early[pushed > 0.0][-1] <= 6.5
    assert pushed.max() == pytest.approx(20.0, rel=0.01)


def test_the_current_is_level_and_varies_about_its_mean():
    speeds = []
    for seed in range(10):
        current = np.array([Disturbances(ROUGH, seed).current_m_s(t) for t in TIMES[::20]])
        assert not current[:, 2].any()
        speed = np.linalg.norm(current, axis=1)
        assert 0.6 <= speed.min() < speed.max() <= 1.0
        assert np.linalg.norm(np.diff(current, axis=0), axis=1).max() < 0.1  # in 0.2 s
        speeds.append(speed.mean())
    assert np.mean(speeds) == pytest.approx(0.8, rel=0.05)


def test_one_seed_means_the_same_in_all_settings():
    directions = []
    for settings in (TYPICAL, ROUGH):
        current = Disturbances(settings, 5).current_m_s(7.0)
        directions.append(current / np.linalg.norm(current))
    np.testing.assert_allclose(*directions)
    same = Disturbances(TYPICAL, 5).receptacle(7.0)
    np.testing.assert_array_equal(same, Disturbances(TYPICAL, 5).receptacle(7.0))
    assert not np.array_equal(same, Disturbances(TYPICAL, 6).receptacle(7.0))


def test_the_presets_are_those_of_the_studies():
    assert set(PRESETS) == {"calm", "typical", "rough"}


@pytest.mark.parametrize(
    ("name", "settings"),
    [
        ("receptacle.hz", {"receptacle": Sway(0.1, -1.0)}),
        ("push_for_s", {"push_for_s": 0.0}),
        ("current_m_s", {"current_m_s": np.nan}),
    ],
)
def test_a_number_out_of_range_is_named(name: str, settings: dict):
    with pytest.raises(InvalidConfiguration, match=name):
        DisturbanceSettings(**settings)
