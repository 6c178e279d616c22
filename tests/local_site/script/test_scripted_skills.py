"""The scripted hand at a console with an arm. On a board: `tests/integration/test_whole_loop.py`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from msgspec import structs

from farhand.deploy.places import sample_files
from farhand.local_site.console import intents
from farhand.local_site.script.scripted_actions import RealTime, ScriptedActions
from farhand.local_site.script.scripted_skills import skill_for
from farhand.local_site.teaching.demonstration import Demonstration
from farhand.local_site.workcell.arm_drivers import SteppedArm
from tests.cells import JACO
from tests.local_site.robot_end import HOT_STAB, desk


def demonstrate(folder: Path, n: int, seed: int = 0) -> tuple[str, list[Demonstration]]:
    """Hash of the first model, and what was demonstrated."""
    with desk(folder, HOT_STAB, place=SteppedArm(HOT_STAB, JACO)) as it:
        skill = skill_for(HOT_STAB, ScriptedActions(it.console, RealTime()), seed)
        for number in range(1, n + 1):
            skill.demonstrate(number)
            it.until(lambda p, k=number: p.n_demonstrations == k and not p.recording)
        assert len(it.picture.stroke_frames) == n
        return it.picture.revisions[0].sha256, list(it.library.chosen.demonstrations)


def test_the_arm_is_led_into_its_receptacle_from_another_place_each_time_and_a_seed_is_one_model(tmp_path):
    sha256, (first, second) = demonstrate(tmp_path / "a", 2)
    for shown in (first, second):
        assert shown.space.oriented
        np.testing.assert_allclose(np.diff(shown.time_s), 0.01)
        assert 0.075 < shown.in_frame()[-1, 2] < 0.090
    assert np.linalg.norm(first.frame_origin_m - second.frame_origin_m) > 0.01
    files = list((tmp_path / "a" / "hot-stab").glob("*.npz"))
    assert len(files) == 2 and all(Demonstration.load(file).quat_wxyz is not None for file in files)
    assert demonstrate(tmp_path / "b", 1)[0] == sha256


def test_the_plug_is_led_out_of_it_too(tmp_path: Path):
    task = structs.replace(HOT_STAB, name="out", skill="extract")
    with desk(tmp_path, task, place=SteppedArm(task, JACO)) as it:
        skill_for(task, ScriptedActions(it.console, RealTime()), 3).demonstrate(1)
        it.until(lambda p: p.n_demonstrations == 1)
        (shown,) = it.library.chosen.demonstrations
        assert shown.in_frame()[0, 2] > 0.08 and shown.in_frame()[-1, 2] < -0.10


def test_the_samples_are_learned_as_poses_and_undone_bit_for_bit(tmp_path: Path):
    with desk(
        tmp_path, HOT_STAB, place=SteppedArm(HOT_STAB, JACO, lambda task: sample_files(task)[:2])
    ) as it:
        it.console.submit(intents.LoadSamples())
        two = it.until(lambda p: p.n_demonstrations == 2)
        it.console.submit(intents.Undo())
        none = it.until(lambda p: p.n_demonstrations == 0)
        assert none.learned is None and two.learned is not None
        it.console.submit(intents.SelectRevision(1))
        back = it.until(lambda p: p.revision == 1).learned
        assert back is not None and back.content == two.learned.content


def test_what_is_being_recorded_of_the_arm_can_be_recovered_in_its_frame(tmp_path: Path):
    with desk(tmp_path, HOT_STAB, place=SteppedArm(HOT_STAB, JACO, seed=2)) as it:
        arm = it.picture.own_arm
        assert arm is not None
        goal = arm.tip + np.array([0.0, 0.05, 0.0, 0.0, 0.0, 0.0, 0.0])
        it.console.submit(intents.RecordDemonstration())
        for time_s in np.arange(0.0, 1.5, 0.05).tolist():
            it.console.submit(intents.Hand(tuple(goal.tolist()), time_s))
        it.console.submit(intents.ResetArm())
        it.told("end or undo it first")
        it.until(lambda p: len(p.strokes) == 1 and len(p.strokes[0]) > 130)
    with desk(tmp_path, HOT_STAB, place=SteppedArm(HOT_STAB, JACO, seed=7)) as it:
        it.console.submit(intents.Recover())
        it.until(lambda p: p.n_demonstrations == 1)
        (shown,) = it.library.chosen.demonstrations
        np.testing.assert_allclose(shown.frame_origin_m[0], arm.receptacle[:3])
