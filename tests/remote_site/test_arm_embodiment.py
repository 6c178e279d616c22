from __future__ import annotations

import pytest

from common.control_mode import ControlMode, Phase
from common.errors import InvalidConfiguration
from remote_site.arm_embodiment import ArmEmbodiment
from remote_site.config import RemoteConfig
from tests.remote_site.arm_bench import HOT_STAB, ArmBench


def test_a_hot_stab_by_commands_ends_seated_and_is_reported():
    bench = ArmBench().executing()
    bench.run_until(Phase.SEATED)
    bench.run(2.0)
    assert bench.mode is ControlMode.AUTONOMOUS and bench.robot.phase is Phase.SEATED
    report = bench.report
    assert report.succeeded and report.arrived_after_s is not None
    assert report.depth_m == pytest.approx(0.085, abs=1e-3) and report.depth_m == bench.depth_m
    assert report.lateral_m is not None and report.lateral_m < 0.004
    assert report.peak_force_n is not None and report.peak_force_n < 150.0
    assert report.holding_force_n == pytest.approx(20.0, abs=6.0)


def test_an_arm_runs_at_its_own_rate_and_no_other():
    with pytest.raises(InvalidConfiguration, match="control_hz"):
        ArmEmbodiment(HOT_STAB, RemoteConfig(control_hz=50.0), None)
    assert ArmEmbodiment(HOT_STAB, RemoteConfig(control_hz=100.0), None).control_hz == 100.0
