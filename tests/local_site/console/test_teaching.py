"""Recording, rolling back, recovering and sending, with a real library and a robot's end in memory."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from farhand.common.errors import InvalidDemonstration
from farhand.common.mode_table import Action
from farhand.common.wire.messages import ModelTransfer
from farhand.local_site.console import intents
from farhand.local_site.recordings.importing import read_demonstrations
from farhand.local_site.recordings.options import ImportOptions
from farhand.local_site.teaching.demonstration import Demonstration
from farhand.local_site.teaching.task_library import TaskLibrary
from farhand.local_site.teaching.teaching_permission import NotNow
from tests.local_site.console.test_console import teach
from tests.local_site.robot_end import FRAMES, TASK, Desk, desk, stroke


def begin(it: Desk) -> tuple[np.ndarray, np.ndarray]:
    """Half a demonstration."""
    positions, times = stroke()
    it.console.submit(intents.RecordDemonstration())
    for position, time_s in zip(positions, times, strict=True):
        it.console.submit(intents.Hand(tuple(position.tolist()), float(time_s)))
    it.until(lambda p: p.recording and len(p.strokes) == 1)
    return positions, times


@pytest.mark.parametrize("action", [Action.STOP, Action.ABORT])
def test_stop_and_abort_roll_back_to_before_the_demonstration_and_offer_it_again(tmp_path, action):
    with desk(tmp_path) as it:
        it.connected()
        positions, _ = begin(it)
        it.console.submit(intents.CommandRobot(action))
        picture = it.told("rolled back")
        assert not picture.recording and picture.learned is None and picture.n_demonstrations == 0
        it.until(lambda p: p.can_recover)
        it.console.submit(intents.Recover())
        picture = it.until(lambda p: p.n_demonstrations == 1)
        assert picture.learned is not None and not picture.can_recover
        np.testing.assert_allclose(picture.strokes[0][-1], positions[-1], atol=0.02)


def test_control_that_is_given_back_at_once_ends_no_demonstration_and_lost_control_offers_it_again(tmp_path):
    with desk(tmp_path) as it:
        it.connected()
        begin(it)
        it.robot.report(lease="")
        it.until(lambda p: not p.in_control)
        it.robot.report()
        assert it.until(lambda p: p.in_control).recording
        it.robot.report(lease="")
        it.told("the control of the robot was lost")
        assert it.until(lambda p: p.can_recover).n_demonstrations == 0


def test_without_ever_having_had_the_control_a_demonstration_goes_on(tmp_path: Path):
    with desk(tmp_path) as it:
        begin(it)
        it.robot.report(lease="")
        it.until(lambda p: p.robot is not None)
        assert it.picture.recording


def test_a_crash_in_the_middle_leaves_what_was_recorded_to_the_next_process(tmp_path: Path):
    positions, times = stroke()
    crashed = TaskLibrary(TASK, tmp_path)
    crashed.record(FRAMES)
    for position, time_s in zip(positions, times, strict=True):
        crashed.hand(position, float(time_s))
    # No end, no undo, no close: the process is gone here.
    with desk(tmp_path) as it:
        assert it.until(lambda p: p.can_recover).learned is None
        it.console.submit(intents.Recover())
        picture = it.until(lambda p: p.n_demonstrations == 1)
        recovered = picture.strokes[0]
        assert len(recovered) >= len(crashed.current) - 51  # a second of samples, 0.02 s each, and one
        np.testing.assert_allclose(recovered, crashed.current[: len(recovered)], atol=1e-9)
        it.console.submit(intents.Recover())
        it.told("no demonstration can be recovered")


def test_samples_that_are_no_motion_are_refused_and_nothing_is_half_recorded(tmp_path: Path):
    folder = tmp_path / TASK.name
    folder.mkdir()
    within = '{"frame_origin_m":[[0.7,0.3]],"frame_rotation":[[[1.0,0.0],[0.0,1.0]]]}'
    (folder / "under-way.jsonl").write_text(f"{within}\n[0.0,0.1,0.1]\n[0.1,0.1,0.1]\n[9000.0,0.2,0.2]\n")
    library = TaskLibrary(TASK, tmp_path)
    with pytest.raises(InvalidDemonstration, match="time_s"):
        library.recover()
    assert not library.recording and library.learned is None and not library.can_undo


def test_undoing_an_earlier_demonstration_keeps_what_was_set_aside_for_a_later_process(tmp_path: Path):
    library = TaskLibrary(TASK, tmp_path)
    for ended in (True, False):
        library.record(FRAMES)
        for position, time_s in zip(*stroke(), strict=True):
            library.hand(position, float(time_s))
        library.end() if ended else library.set_aside()
    library.undo()
    assert library.left_over is not None and TaskLibrary(TASK, tmp_path).left_over is not None


def test_what_is_asked_at_the_wrong_moment_is_refused(tmp_path: Path):
    library = TaskLibrary(TASK, tmp_path)
    with pytest.raises(NotNow, match="no demonstration can be recovered"):
        library.recover()


def test_the_revisions_are_shown_and_gone_back_to(tmp_path: Path):
    with desk(tmp_path) as it:
        it.console.submit(intents.LoadSamples())
        three = it.until(lambda p: p.n_demonstrations == 3)
        assert [revision.number for revision in three.revisions] == [1] and three.revision == 1
        teach(it)
        four = it.until(lambda p: p.n_demonstrations == 4)
        it.console.submit(intents.StartAnew())
        assert it.until(lambda p: p.n_demonstrations == 0).learned is None
        it.console.submit(intents.SelectRevision(2))
        again = it.until(lambda p: p.n_demonstrations == 4)
        assert again.learned is not None and four.learned is not None
        assert again.learned.sha256 == four.learned.sha256
        it.console.submit(intents.Delete(1))
        it.until(lambda p: [revision.number for revision in p.revisions] == [2, 3])
        it.console.submit(intents.SelectRevision(1))
        it.told("revision 1 is not kept any more")


def test_one_demonstration_is_deleted_by_name_and_undo_brings_it_back(tmp_path: Path):
    with desk(tmp_path) as it:
        it.console.submit(intents.LoadSamples())
        three = it.until(lambda p: p.n_demonstrations == 3)
        second = intents.RemoveDemonstration(three.demonstration_names[1])
        for _ in range(2):  # as by a double click
            it.console.submit(second)
        it.told("delete demonstration: refused: this demonstration is not in the current revision any more")
        assert it.picture.demonstration_names == (three.demonstration_names[0], three.demonstration_names[2])
        it.console.submit(intents.Undo())
        again = it.told("undo: the deleted demonstration is back")
        assert again.demonstration_names == three.demonstration_names
        assert again.learned is not None and three.learned is not None
        assert again.learned.sha256 == three.learned.sha256


def test_a_file_that_cannot_be_learned_is_refused_by_name_and_nothing_else_is_lost(tmp_path: Path):
    positions, times = stroke(45)
    good = Demonstration.within(FRAMES, TASK.frame_names, times, positions)
    refused = {
        "garbage.npz": (b"PK of nothing", "a whole .npz file of plain arrays"),
        "nothing.npz": (b"", "nothing.npz is empty, or too large to be uploaded"),
        "other-frames.npz": (replace(good, frame_names=("elsewhere",)).encode(), "frames"),
        "milliseconds.npz": (replace(good, time_s=1e3 * times).encode(), "it looks like milliseconds"),
        "a-point.npz": (replace(good, position_m=0.0 * positions + 0.5).encode(), "a motion of at least"),
    }
    with desk(tmp_path) as it:
        teach(it)
        before = it.until(lambda p: p.n_demonstrations == 1)
        for name, (content, why) in refused.items():
            it.console.submit(intents.LearnFile(name, content))
            state = it.told(name)
            assert state.notices[-1].what == "upload" and not state.notices[-1].good
            assert why in state.notices[-1].text and "\n" not in state.notices[-1].text, state.notices[
                -1
            ].text
            assert state.learned is before.learned
        it.console.submit(intents.LearnFile("good.npz", good.encode()))
        state = it.told("upload: learned good.npz as demonstration 2")
        assert state.demonstrations[-1].source == "good.npz"
        it.console.submit(intents.LearnFile("again.npz", good.encode()))
        it.told("again.npz is learned already: nothing was added")
        short = replace(good, position_m=positions - [0.0, 0.2], time_s=1.1 * times)
        it.console.submit(intents.LearnFile("short.npz", short.encode()))
        it.told("learned short.npz as demonstration 3; it ends 200 mm from the target: Undo takes it back")
        it.console.submit(intents.Undo())
        it.until(lambda p: p.n_demonstrations == 2)


def test_what_another_program_recorded_is_imported_uploaded_and_learned(tmp_path: Path):
    positions, times = stroke(45)
    rows = [f"{1e3 * t:.3f};{1e3 * x:.3f};{1e3 * y:.3f}" for t, (x, y) in zip(times, positions, strict=True)]
    file = tmp_path / "drawn.csv"
    file.write_text("\n".join(["time [ms];x [mm];y [mm]", *rows]))
    (frame,) = FRAMES
    at = ",".join(map(str, frame.b))
    (made,) = read_demonstrations(file, ImportOptions(frames=(f"{TASK.frame_names[0]}={at}",)))
    np.testing.assert_allclose(made.position_m, positions, atol=1e-6)
    with desk(tmp_path) as it:
        it.console.submit(intents.LearnFile("drawn_01.npz", made.encode()))
        state = it.told("upload: learned drawn_01.npz as demonstration 1")
        ends = state.demonstrations[0].position_m[[0, -1]]
        np.testing.assert_allclose(ends, positions[[0, -1]], atol=1e-6)


def test_a_model_is_sent_by_itself_whenever_it_changes_if_so_chosen(tmp_path: Path):
    with desk(tmp_path) as it:
        it.connected()
        it.console.submit(intents.LoadSamples())
        it.until(lambda p: p.n_demonstrations == 3)
        assert not it.robot.heard(ModelTransfer)
        teach(it)
        it.console.submit(intents.AutoSend(True))
        first = it.until(lambda p: bool(p.confirmed_sha256)).confirmed_sha256
        it.console.submit(intents.Undo())
        picture = it.until(lambda p: p.confirmed_sha256 not in ("", first))
        assert picture.learned is not None and picture.learned.sha256 == picture.confirmed_sha256
        sent = it.robot.heard(ModelTransfer)
        assert [transfer.parent_sha256 for transfer in sent][-1] == first
