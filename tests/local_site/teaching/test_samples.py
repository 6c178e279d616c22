from __future__ import annotations

import numpy as np

from farhand.local_site.teaching.samples import sample_strokes
from tests.local_site.robot_end import TASK


def test_each_stroke_leads_from_the_first_waypoint_to_the_last_in_its_time():
    strokes = sample_strokes(TASK)
    assert len(strokes) == len(TASK.samples)
    for stroke, sample in zip(strokes, TASK.samples, strict=True):
        np.testing.assert_allclose(stroke.position_m[0], sample.waypoints_m[0], atol=1e-9)
        np.testing.assert_allclose(stroke.position_m[-1], sample.waypoints_m[-1], atol=1e-9)
        assert stroke.time_s[0] == 0.0 and abs(stroke.time_s[-1] - sample.duration_s) <= 0.02
        assert (np.diff(stroke.time_s) > 0).all()
        for waypoint in sample.waypoints_m:
            assert np.linalg.norm(stroke.position_m - waypoint, axis=1).min() < 0.01


def test_a_hand_begins_and_ends_at_rest():
    for stroke in sample_strokes(TASK, seed=3):
        speed = np.linalg.norm(np.diff(stroke.position_m, axis=0), axis=1) / 0.02
        assert speed[0] < 0.05 * speed.max() and speed[-1] < 0.05 * speed.max()


def test_the_tremor_is_seeded_slight_and_vanishes_at_both_ends():
    plain, one, same, other = (sample_strokes(TASK, seed) for seed in (None, 1, 1, 2))
    for a, b, c, d in zip(plain, one, same, other, strict=True):
        np.testing.assert_array_equal(b.position_m, c.position_m)
        assert not np.array_equal(b.position_m, d.position_m)
        off = np.linalg.norm(b.position_m - a.position_m, axis=1)
        assert 1e-4 < off.max() < 0.03
        assert off[0] < 1e-9 and off[-1] < 1e-9
