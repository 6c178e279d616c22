"""Another task is chosen at the console: what follows it, and when it is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from msgspec import structs

from farhand.common.mode_table import Action, ControlMode
from farhand.common.wire import keys
from farhand.common.wire.messages import Command, ModelTransfer
from farhand.deploy.places import find_task, sample_files
from farhand.local_site.console import intents
from farhand.local_site.workcell.arm_drivers import SteppedArm
from farhand.local_site.workcell.hand_motion import Nudge
from tests.cells import JACO
from tests.local_site.console.test_console import a_path, teach
from tests.local_site.robot_end import HOT_STAB, TASK, Desk, desk

OTHER = structs.replace(TASK, name="other", require_preview=True)
HOT_STAB_REMOVAL = find_task("hot-stab-removal")


def choose(it: Desk, name: str) -> None:
    it.console.submit(intents.Choose(name))
    it.until(lambda p: p.task.name == name)


def test_teaching_previewing_and_executing_are_about_the_chosen_task(tmp_path: Path):
    with desk(tmp_path, TASK, OTHER) as it:
        it.connected(ControlMode.HOLD)
        teach(it)
        it.console.submit(intents.SendModel())
        confirmed = it.until(lambda p: bool(p.confirmed_sha256)).confirmed_sha256
        it.robot.say(keys.PATH, a_path(plan_id=5, sha256=confirmed))
        it.until(lambda p: p.plan_id == 5)
        choose(it, "other")
        picture = it.picture
        assert (picture.plan_id, picture.path, picture.confirmed_sha256, picture.learned) == (
            0,
            None,
            "",
            None,
        )
        assert picture.task.require_preview and picture.n_demonstrations == 0
        assert [(t.name, t.n_demonstrations, t.differs) for t in picture.tasks] == [
            ("planar", 1, False),
            ("other", 0, False),
        ]
        teach(it)
        assert it.picture.tasks[1].differs
        it.console.submit(intents.SendModel())
        it.until(lambda p: bool(p.confirmed_sha256))
        assert [transfer.task for transfer in it.robot.heard(ModelTransfer)] == ["planar", "other"]
        it.console.submit(intents.CommandRobot(Action.PREVIEW))
        (preview,) = it.robot.wait_for(Command)
        assert (preview.task, preview.model_sha256) == ("other", it.picture.confirmed_sha256)


@pytest.mark.parametrize(
    ("mode", "fields", "words"),
    [
        (ControlMode.AUTONOMOUS, {}, "the robot executes planar"),
        (ControlMode.PAUSED, {}, "the robot executes planar"),
        (ControlMode.DIRECT, {"recorded_s": 1.0}, "a demonstration is being recorded"),
    ],
)
def test_another_task_is_not_chosen_while_the_robot_executes_or_records(tmp_path: Path, mode, fields, words):
    with desk(tmp_path, TASK, OTHER) as it:
        it.connected(mode, **fields)
        it.console.submit(intents.Choose("other"))
        assert it.told(words).task is TASK


def test_another_task_is_not_chosen_while_something_is_recorded_here_or_a_preview_is_under_way(
    tmp_path: Path,
):
    with desk(tmp_path, TASK, OTHER) as it:
        it.connected(ControlMode.HOLD)
        it.console.submit(intents.RecordDemonstration())
        it.console.submit(intents.Choose("other"))
        assert it.told("a demonstration is being recorded").task is TASK
        it.console.submit(intents.Undo())
        teach(it)
        it.console.submit(intents.SendModel())
        it.until(lambda p: bool(p.confirmed_sha256))
        it.console.submit(intents.CommandRobot(Action.PREVIEW))
        it.until(lambda p: Action.PREVIEW in p.pending)
        it.console.submit(intents.Choose("other"))
        assert it.told("preview is under way already").task is TASK


def test_the_operators_arm_starts_where_the_chosen_task_does_and_its_samples_follow(tmp_path: Path):
    place = SteppedArm(HOT_STAB, JACO, lambda task: sample_files(task)[:1], seed=3)
    with desk(tmp_path, HOT_STAB, HOT_STAB_REMOVAL, place=place) as it:
        before = place.view
        assert before.depth_m < 0.0
        choose(it, "hot-stab-removal")
        seated = place.view
        assert seated.depth_m > 0.07 and seated.seed == 3
        assert it.picture.own_frames[0].b == pytest.approx(seated.receptacle[:3])
        it.console.submit(intents.LoadSamples())
        it.until(lambda p: p.n_demonstrations == 1)
        (shown,) = it.library.chosen.demonstrations
        assert np.linalg.norm(shown.in_frame()[0, :3]) < 0.1 < np.linalg.norm(shown.in_frame()[-1, :3])
        choose(it, "hot-stab")
        np.testing.assert_array_equal(place.view.tip, before.tip)


def test_a_demonstration_begins_at_a_new_place_only_where_the_arm_stands_at_the_end_of_the_last(
    tmp_path: Path,
):
    with desk(tmp_path, HOT_STAB, place=SteppedArm(HOT_STAB, JACO, sample_files)) as it:

        def record() -> int:
            it.console.submit(intents.RecordDemonstration())
            arm = it.until(lambda p: p.recording).own_arm
            assert arm is not None
            return arm.seed

        def discard() -> None:
            it.console.submit(intents.Undo())
            it.until(lambda p: not p.recording)

        def push() -> None:
            it.console.submit(intents.StepArm(Nudge((0.0, 0.0, 0.05))))
            it.until(lambda p: bool(p.strokes))

        assert record() == 0
        discard()  # nothing moved: the place is as good as new
        assert record() == 0
        push()
        discard()
        assert record() == 1
        assert it.told("recording a demonstration from a new place").recording
        push()
        discard()
        it.console.submit(intents.StepArm(Nudge((0.0, 0.0, -0.05))))  # and then it is led away by hand
        assert record() == 1
