from __future__ import annotations

import math

import numpy as np
import pytest

from farhand.remote_site.interface.plant import EffectorState
from farhand.remote_site.robots.point_embodiment import TrackingRecord
from tests.remote_site.bench import DT_S, Sight
from tests.remote_site.planar import TASK


def test_the_error_is_the_root_mean_square_of_what_was_measured():
    record = TrackingRecord(Sight(TASK))
    assert record.rms_m is None and record.newest_m is None
    for distance_m in (0.003, 0.004):
        record.add(distance_m, 0.1)
    assert record.rms_m == pytest.approx(math.sqrt((9 + 16) / 2) * 1e-3)
    assert record.newest_m == 0.004 and record.tracked_s == pytest.approx(0.2)


def test_the_error_is_of_the_first_ten_seconds_and_the_newest_goes_on():
    record = TrackingRecord(Sight(TASK))
    for _ in range(100):
        record.add(0.001, 0.1)
    for _ in range(50):
        record.add(1.0, 0.1)
    assert record.tracked_s == pytest.approx(10.0, abs=0.11)
    assert record.rms_m is not None and record.rms_m < 0.2
    assert record.newest_m == 1.0


def test_a_target_that_nobody_can_see_leaves_the_error_unknown():
    class Unknown:
        def observe(self, now_s: float) -> None:
            return None

        def true_origin_m(self, now_s: float) -> None:
            return None

    record = TrackingRecord(Unknown())
    record.measure(EffectorState(np.zeros(2), np.zeros(2)), True, 0.0, DT_S)
    assert record.tracked_s == DT_S, "its end is known all the same"
    assert record.fields()["rms_error_m"] is None and record.newest_m is None


def test_a_machine_knows_no_true_target():
    class Camera:
        def observe(self, now_s: float) -> None:
            return None

    record = TrackingRecord(Camera())
    for _ in range(600):
        record.measure(EffectorState(np.zeros(2), np.zeros(2)), True, 0.0, DT_S)
    assert record.tracked_s == pytest.approx(10.0, abs=0.021) and record.rms_m is None


def test_only_what_comes_after_the_arrival_counts():
    record = TrackingRecord(Sight(TASK))
    at = EffectorState(np.array(TASK.target.origin_m), np.zeros(2))
    record.measure(at, False, 0.0, DT_S)
    assert record.newest_m is None
    record.measure(at, True, 0.0, DT_S)
    assert record.newest_m == 0.0
