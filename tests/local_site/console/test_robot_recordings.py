"""What the robot recorded and this site did not expect, lost, undid or has learned already: real sites in virtual time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from msgspec import structs

from farhand.common.mode_table import Action, ControlMode
from farhand.local_site.console import intents
from tests.meeting import Meeting, Site
from tests.remote_site.bench import DT_S
from tests.remote_site.planar import TASK


@pytest.fixture
def meeting() -> Meeting:
    return Meeting()


@pytest.fixture
def ann(meeting: Meeting, tmp_path: Path) -> Site:
    return meeting.join("ann", tmp_path / "ann")


def driving(site: Site) -> None:
    """Coupled, recorded by the robot, and on the way."""
    site.ask(Action.ARM, Action.COUPLE, intents.RecordDemonstration())
    for k in range(10):
        site.drive(0.1, 0.02 * k, 0.01 * k)
    assert site.picture.robot_records and not site.picture.recording


def test_the_page_sees_for_how_long_the_robot_has_recorded_and_what_came_of_it(meeting: Meeting, ann: Site):
    driving(ann)
    assert ann.picture.recorded_s == pytest.approx(1.0, abs=0.1)
    picture = ann.ask(intents.EndDemonstration())
    assert picture.mode is ControlMode.DIRECT and picture.recorded_s is None and picture.fetching is None
    assert picture.n_demonstrations == 1 and picture.learned is not None and not picture.can_recover
    (shown,) = ann.library.chosen.demonstrations
    np.testing.assert_allclose(picture.strokes[0], _seen_from_the_end(shown), atol=1e-12)


def _seen_from_the_end(shown) -> np.ndarray:
    end = shown.frames_at(-1)[-1]
    return np.stack([
        end.to_world(shown.frames_at(t)[-1].to_local(point)) for t, point in enumerate(shown.position_m)
    ])  # fmt: skip


def test_a_stop_leaves_the_model_as_it_was_and_what_was_recorded_can_be_recovered(
    meeting: Meeting, ann: Site
):
    before = ann.ask(intents.LoadSamples()).learned
    driving(ann)
    picture = ann.ask(Action.STOP)
    assert picture.learned is before and picture.can_recover and picture.fetching is None
    assert ann.told("recorded: interrupted after")
    picture = ann.ask(intents.Recover())
    assert before is not None and picture.learned is not None and not picture.can_recover
    assert picture.learned.model.n_demonstrations == before.model.n_demonstrations + 1
    undone = ann.ask(intents.Undo()).learned
    assert undone is not None and undone.sha256 == before.sha256


def test_undo_while_the_robot_records_learns_nothing(meeting: Meeting, ann: Site):
    driving(ann)
    picture = ann.ask(intents.Undo())
    assert not picture.robot_records and picture.learned is None and picture.can_recover


def test_a_silent_operator_has_learned_nothing_and_can_recover_it_later(meeting: Meeting, ann: Site):
    driving(ann)
    ann.link.cut()
    meeting.run(8.0)
    assert meeting.mode is ControlMode.HOLD
    ann.link.mend()
    meeting.run(2.0)
    assert ann.picture.learned is None and ann.picture.can_recover
    assert ann.ask(intents.Recover()).n_demonstrations == 1


def test_an_operators_site_that_dies_before_it_has_fetched_finds_it_again(
    meeting: Meeting, ann: Site, tmp_path: Path
):
    driving(ann)
    ann.console.submit(intents.EndDemonstration())
    meeting.run(DT_S)
    meeting.leave(ann)
    meeting.run(1.0)
    again = meeting.join("ann", tmp_path / "ann")
    assert again.picture.n_demonstrations == 0 and again.picture.can_recover
    assert again.ask(intents.Recover()).n_demonstrations == 1
    meeting.leave(again)
    third = meeting.join("ann", tmp_path / "ann")
    assert third.picture.n_demonstrations == 1 and not third.picture.can_recover


def test_another_site_is_not_offered_it(meeting: Meeting, ann: Site, tmp_path: Path):
    driving(ann)
    ann.ask(Action.STOP)
    bob = meeting.join("bob", tmp_path / "bob")
    assert not bob.picture.can_recover
    bob.ask(intents.Recover())
    assert bob.told("refused: no demonstration can be recovered")


def test_a_restarted_robot_has_none_any_more_and_the_operator_is_told(meeting: Meeting, ann: Site):
    driving(ann)
    meeting.restart_robot()
    meeting.run(1.0)
    assert meeting.mode is ControlMode.DISARMED
    assert ann.told("its recordings are lost")
    assert ann.picture.learned is None and not ann.picture.can_recover and ann.picture.fetching is None


def test_what_arrives_while_another_demonstration_is_made_is_learned_after_it(meeting: Meeting, ann: Site):
    driving(ann)
    ann.console.submit(intents.CommandRobot(Action.CLUTCH))
    while ann.picture.mode is not ControlMode.HOLD:
        meeting.run(DT_S)
    ann.link.stalled = True
    picture = ann.ask(intents.RecordDemonstration())
    assert picture.recording and picture.fetching is not None and not picture.can_recover
    ann.link.mend()
    meeting.run(0.5)
    assert ann.picture.recording and ann.picture.n_demonstrations == 0
    ann.ask(intents.Undo())
    assert ann.picture.n_demonstrations == 1 and not ann.picture.recording


def test_it_is_learned_into_the_task_that_it_was_made_for_though_another_one_is_chosen_by_then(
    tmp_path: Path,
):
    meeting = Meeting([TASK, structs.replace(TASK, name="other")])
    ann = meeting.join("ann", tmp_path / "ann")
    driving(ann)
    ann.console.submit(intents.EndDemonstration())
    while ann.picture.robot_records or ann.picture.fetching is None:
        meeting.run(DT_S)
    ann.link.stalled = True
    assert ann.ask(intents.Choose("other")).fetching is not None
    ann.link.mend()
    meeting.run(0.5)
    assert ann.told("record: learned the robot's recording: planar,")
    assert [task.n_demonstrations for task in ann.picture.tasks] == [1, 0]
    # And for the one that is chosen, though the robot has not executed it yet.
    driving(ann)
    ann.ask(intents.EndDemonstration())
    assert [task.n_demonstrations for task in ann.picture.tasks] == [1, 1]
