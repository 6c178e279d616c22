from __future__ import annotations

import pytest

from farhand.common.wire.messages import Stamp
from tests.remote_site.bench import DT_S, Bench

NOW = Stamp("boot", 7)


def test_before_the_arrival_nothing_is_reported_as_an_error():
    bench = Bench().executing()
    assert bench.robot.last_execution is not None
    report = bench.robot.last_execution.report(NOW, overruns=3)
    assert report.arrived_after_s is None and report.rms_error_m is None and report.tracked_s == 0.0
    assert report.overruns == 3 and report.stamp == NOW


def test_the_arrival_is_reported_once_with_its_time_and_the_distance_since():
    bench = Bench().executing()
    execution = bench.robot.last_execution
    assert execution is not None
    while execution.arrived_after_s is None:
        bench.run(DT_S)
    arrived_after_s = execution.arrived_after_s
    began_s = execution.began.t_ns * 1e-9
    assert arrived_after_s == pytest.approx(bench.clock.now_s() - began_s, abs=2 * DT_S)
    bench.run(2.0)
    report = execution.report(NOW, overruns=0)
    assert report.arrived_after_s == arrived_after_s
    assert report.tracked_s == pytest.approx(2.0, abs=2 * DT_S)
    assert report.rms_error_m is not None and 0.0 < report.rms_error_m < 0.02
    assert report.model_sha256 == execution.stored.sha256


def test_the_record_outlives_the_execution():
    bench = Bench().arrived()
    execution = bench.robot.last_execution
    bench.stop()
    bench.run(0.5)
    assert bench.robot.last_execution is execution
    assert bench.robot.motion.execution is None
