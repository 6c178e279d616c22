"""The robot as it is shipped, by commands: arm, physics, perception, model; what is wrong is made wrong for real."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from farhand.common.arm.simulation.disturbances import DisturbanceSettings, Sway
from farhand.common.arm.simulation.receptacle import FACING_QUAT
from farhand.common.arm.simulation.starts_and_goals import Placement, Withdrawn
from farhand.common.mode_table import ControlMode
from farhand.evaluation.arm import hot_stab_removal
from farhand.evaluation.arm.arm_trial import STIFF, Conditions, Trial
from farhand.evaluation.arm.hot_stab import taught
from farhand.remote_site.perception.simulated_sight import TYPICAL
from tests.cells import JACO
from tests.messages import said
from tests.remote_site.arm_bench import ArmBench


@pytest.mark.parametrize(
    "seed", [1, 14]
)  # 14: a correction faster than the arm would swing in the bore, with 133 N
def test_a_learned_insertion_succeeds_with_typical_noise_and_holds_gently(seed: int):
    record = Trial(taught(), Conditions(noise=TYPICAL), seed).run()
    assert record.success
    assert record.local[-1][2] > 0.080
    assert record.peak_n < 110.0 and record.hold_n < 25.0


def test_what_it_inserted_comes_out_again_as_learned_without_being_pressed_further_in():
    goal, trial = Withdrawn(), Trial(taught(), Conditions(noise=TYPICAL), 7)
    assert trial.run().success
    trial.go_on(hot_stab_removal.taught(), goal)
    record = trial.run()
    assert record.success
    assert record.local[-1][2] < -0.105 and goal.dragged_m < 0.005
    assert record.peak_n < 100.0


def test_one_seed_gives_the_same_bits():
    conditions = Conditions(noise=TYPICAL, disturbances=DisturbanceSettings(receptacle=Sway(0.02, 0.1)))
    one, same = (Trial(taught(), conditions, 2, limit_s=3.0).run() for _ in range(2))
    np.testing.assert_array_equal(np.stack(one.local), np.stack(same.local))
    assert one.force_n == same.force_n


def test_a_receptacle_that_is_lost_for_good_ends_it_with_the_reason():
    record = Trial(taught(), Conditions(lost_s=60.0), 3).run()
    assert record.kind_of_failure.startswith("perception lost")
    deepest = max(point[2] for point in record.local)
    assert deepest < 0.03  # it did not go on blindly


def test_a_receptacle_that_is_lost_for_two_seconds_is_waited_for():
    record = Trial(taught(), Conditions(noise=TYPICAL, lost_s=2.0), 4).run()
    assert record.success


def test_a_preflight_that_is_obeyed_keeps_the_arm_where_it_is():
    """The wrist would be straight on the way in: the receptacle is high before it."""
    conditions, above = (
        Conditions(noise=TYPICAL, wide=True, obeying=True),
        np.array([0.80, 0.0, 0.50]),
    )
    placed = Placement(np.concatenate([above, FACING_QUAT]), np.array(JACO.robot.home_rad))
    trial = Trial(taught(), conditions, 8, placed)
    start = trial.arm.simulation.tip
    record = trial.run()
    assert record.cause == f"refused: {record.refusal}" and record.refusal
    assert record.kind_of_failure.startswith("refused")
    np.testing.assert_allclose(trial.arm.simulation.tip[:3], start[:3], atol=1e-3)


def test_a_sensor_that_breaks_ends_it_before_anything_moves_on(monkeypatch: pytest.MonkeyPatch):
    bench = ArmBench(seed=6).executing()
    bench.run(1.0)
    assert bench.mode is ControlMode.AUTONOMOUS
    with monkeypatch.context() as broken:
        broken.setattr(bench.arm.plant.servo.wrist, "force", np.full(3, np.nan))
        bench.run(bench.dt_s)
    assert bench.mode is ControlMode.STOPPED
    assert said(bench.events("stopped")[-1]) == "a measured number is not finite, or beyond a million"
    bench.run(1.0)
    assert bench.speed_m_s < 2e-3
    assert len(bench.events("stopped")) == 1  # nothing of it is left in what is estimated
    assert np.isfinite(bench.robot.sensing.frames[0].b).all()


@pytest.mark.parametrize("seed", [5])
def test_an_error_that_the_arm_cannot_give_way_to_fails(seed: int):
    """Contact is real: far off the bore, without compliance, correction or retry, the plug does not go in."""
    noise = replace(TYPICAL, bias_m=0.04, bias_rad=0.15)
    conditions = Conditions(noise=noise, compliance=STIFF, correcting=False, attempts=0)
    assert not Trial(taught(), conditions, seed).run().success


@pytest.mark.parametrize("seed", [11, 12])
@pytest.mark.parametrize("arm", ["panda", "baxter-right"])
def test_what_one_arm_was_taught_another_one_executes(arm: str, seed: int):
    """Seven joints in air, taught on six under water."""
    record = Trial(taught(), Conditions(noise=TYPICAL), seed, arm=arm).run()
    assert record.success and record.peak_n < 100.0
