"""Several tasks of one robot: which one counts for what, and an arm that does one after the other."""

from __future__ import annotations

import pytest
from msgspec import structs

from farhand.common.mode_table import Action, ControlMode, Phase
from farhand.common.task import PointTask
from farhand.common.wire.messages import BlobRequest
from farhand.common.wire.motion_encoding import RecordedMotion
from farhand.common.wire.reasons import Code
from tests.messages import said
from tests.remote_site.arm_bench import HOT_STAB_REMOVAL, ArmBench, hot_stab_model, seated
from tests.remote_site.bench import Bench
from tests.remote_site.planar import TASK, transfer
from tests.strategies import learned

MM = 1e-3
HOLDS = structs.replace(TASK, name="other", lost_link="hold", retract_m=(0.0, -0.1))


def two_tasks(other: PointTask = HOLDS) -> Bench:
    """A robot of two tasks, armed, with a model of each."""
    bench = Bench(also=[other]).armed()
    assert bench.send_model().accepted
    assert bench.send_model(transfer(learned(), task=other.name)).accepted
    return bench


def extract(bench: ArmBench) -> None:
    """The operator turns to taking the plug out."""
    bench.task, bench.taught = HOT_STAB_REMOVAL, hot_stab_model("hot-stab-removal")
    bench.execute()


def assert_withdrawn(bench: ArmBench) -> None:
    bench.run_until(Phase.ARRIVED)
    bench.run(2.0)
    report = bench.report
    assert report.task == "hot-stab-removal" and report.succeeded
    assert report.depth_m == pytest.approx(-0.12, abs=15.0 * MM)
    assert report.peak_force_n is not None and report.peak_force_n < 60.0


def test_a_plug_is_inserted_and_then_taken_out_in_one_run():
    bench = ArmBench(seed=1, also=[HOT_STAB_REMOVAL]).executing()
    bench.run_until(Phase.SEATED)
    bench.run(1.5)
    assert (bench.report.task, bench.report.succeeded) == ("hot-stab", True)
    assert bench.command(Action.CLUTCH).accepted
    bench.run(0.5)
    bench.task, bench.taught = HOT_STAB_REMOVAL, hot_stab_model("hot-stab-removal")
    bench.preview(bench.send_model().sha256)
    assert bench.arm.skill.task.name == "hot-stab" and bench.arm.skill.must_seat  # a preview changes nothing
    extract(bench)
    assert bench.arm.skill.task.name == "hot-stab-removal" and not bench.arm.skill.must_seat
    assert_withdrawn(bench)
    told = [said(event) for event in bench.events("executing")]
    assert [text.split()[1] for text in told] == ["hot-stab", "hot-stab-removal"]


def test_a_plug_that_a_restarted_robot_finds_in_the_bore_is_taken_out_by_the_task_that_does():
    bench = ArmBench(remembered=seated(), also=[HOT_STAB_REMOVAL])
    bench.run(1.0)
    assert bench.mode is ControlMode.DISARMED and bench.arm.skill.task.name == "hot-stab"
    extract(bench.armed())
    assert_withdrawn(bench)


def test_the_first_task_counts_until_another_one_is_executed():
    bench = two_tasks()
    bench.preview(transfer().sha256)
    assert bench.robot.embodiment.skill.task is TASK
    bench.task = HOLDS
    bench.preview(transfer(learned()).sha256)
    assert bench.robot.embodiment.skill.task is TASK
    assert bench.command(Action.EXECUTE, model_sha256=transfer(learned()).sha256).accepted
    assert bench.robot.embodiment.skill.task is HOLDS
    assert bench.command(Action.ABORT).accepted and bench.robot.embodiment.skill.task is HOLDS


@pytest.mark.parametrize("task", [TASK, HOLDS], ids=["goes on", "holds"])
def test_a_lost_link_is_answered_by_the_policy_of_the_task_that_is_executed(task: PointTask):
    bench = two_tasks()
    bench.task = task
    sha256 = {TASK.name: transfer(), HOLDS.name: transfer(learned())}[task.name].sha256
    assert bench.command(Action.EXECUTE, model_sha256=sha256).accepted
    bench.run(4.0, present=False)
    assert bench.mode is (ControlMode.PAUSED if task is HOLDS else ControlMode.AUTONOMOUS)


def test_retract_goes_where_the_present_task_says():
    bench = two_tasks()
    bench.task = HOLDS
    assert bench.command(Action.EXECUTE, model_sha256=transfer(learned()).sha256).accepted
    bench.run(0.2)
    assert bench.command(Action.ABORT).accepted
    bench.run(1.0)
    before = bench.position_m
    assert bench.command(Action.RETRACT).accepted
    bench.run(3.0)
    assert bench.position_m - before == pytest.approx((0.0, -0.1), abs=5.0 * MM)


def test_what_is_previewed_before_it_is_executed_is_asked_of_the_task_that_is_named():
    bench = two_tasks(structs.replace(TASK, name="other", require_preview=True))
    refused = bench.command(Action.EXECUTE, task="other", model_sha256=transfer(learned()).sha256)
    assert not refused.accepted and refused.reason is not None and refused.reason.code == Code.NOT_PREVIEWED
    assert bench.command(Action.EXECUTE, model_sha256=transfer().sha256).accepted


@pytest.mark.parametrize("action", [Action.PREVIEW, Action.EXECUTE])
def test_a_model_of_another_task_and_a_task_of_another_robot_are_refused_in_words_that_name_both(
    action: Action,
):
    bench, sha256 = two_tasks(), transfer().sha256
    reply = bench.command(action, task="other", model_sha256=sha256)
    assert said(reply) == f"model {sha256[:8]} is for 'planar', not for 'other'"
    reply = bench.command(action, task="juggling", model_sha256=sha256)
    assert said(reply) == "this robot does 'planar' and 'other', not 'juggling'"


def test_a_recording_is_for_the_task_that_its_operator_has_chosen():
    bench = Bench(also=[HOLDS]).coupled()
    assert bench.command(Action.RECORD, task="juggling").accepted
    assert "not 'juggling'" in said(bench.events("failed")[-1])
    assert bench.command(Action.RECORD, task="other").accepted
    bench.drive(0.5, 0.01)
    assert bench.command(Action.END_RECORDING).accepted
    catalogue, now = bench.robot.recordings.catalogue, bench.robot.stamp()
    (offer,) = catalogue.list(now).recordings
    data = catalogue.part(BlobRequest(sha256=offer.sha256, n_bytes=65_536), now).content
    assert RecordedMotion.from_bytes(data).task == "other"
    assert bench.robot.embodiment.skill.task is TASK  # whoever records executes nothing
