"""What the console knows of demonstrations and models is true: asked, not guessed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from farhand.common.mode_table import ControlMode
from farhand.common.wire.messages import ModelTransfer, OperatorInput
from farhand.local_site.console import intents
from farhand.local_site.teaching.goal import goal_miss
from tests.local_site.console.test_console import teach
from tests.local_site.robot_end import HOT_STAB, Desk, desk, stroke


def draw(it: Desk, end: tuple[float, float]) -> None:
    """A stroke that ends beside the target by this much [m]."""
    positions, times = stroke()
    it.console.submit(intents.RecordDemonstration())
    part = np.linspace(0.0, 1.0, len(times))[:, None]
    for position, time_s in zip(positions + part * np.array(end), times, strict=True):
        it.console.submit(intents.Hand(tuple(position.tolist()), float(time_s)))


def test_a3_the_model_at_the_robot_is_the_one_that_it_confirmed(tmp_path: Path) -> None:
    with desk(tmp_path) as it:
        it.connected()
        teach(it)
        it.console.submit(intents.SendModel())
        sent = it.until(lambda p: p.robot_model is not None).robot_model
        it.console.submit(intents.LoadSamples())
        picture = it.until(lambda p: p.n_demonstrations == 4)
        assert picture.learned is not None and sent is not None
        assert picture.robot_model is sent and picture.learned.sha256 != sent.sha256


def test_a5_a_demonstration_that_misses_the_goal_is_not_learned_without_being_asked(tmp_path: Path) -> None:
    with desk(tmp_path) as it:
        it.connected()
        draw(it, (0.0, 0.2))
        it.console.submit(intents.EndDemonstration())
        picture = it.told("end: it ends 199 mm from the target")
        assert (
            picture.recording and picture.n_demonstrations == 0 and picture.miss == "199 mm from the target"
        )
        it.console.submit(intents.EndDemonstration(anyway=True))
        assert it.until(lambda p: p.n_demonstrations == 1).miss == ""
        draw(it, (0.2, 0.0))
        it.console.submit(intents.EndDemonstration())
        it.until(lambda p: bool(p.miss))
        it.console.submit(intents.Undo())
        assert it.until(lambda p: not p.recording).n_demonstrations == 1
        teach(it)


@pytest.mark.parametrize(
    ("point", "miss"),
    [
        ((0.0, 0.002, 0.085, 1.0, 0.0, 0.0, 0.0), ""),
        (
            (0.082, 0.116, 0.044, 0.983, 0.182, 0.0, 0.0),
            "only 44 mm deep and 142 mm beside the bore and 21° askew",
        ),
        ((0.0, 0.0, -0.03, 1.0, 0.0, 0.0, 0.0), "30 mm before the receptacle"),
        ((0.12, 0.0, 0.20, 1.0, 0.0, 0.0, 0.0), "200 mm past the mouth and 120 mm beside the bore"),
    ],
)
def test_a5_a_miss_says_how_deep_how_far_beside_and_how_askew(point: tuple[float, ...], miss: str) -> None:
    assert goal_miss(HOT_STAB, np.array(point)) == miss


def test_a7_a_drag_whose_coupling_ended_moves_nothing_until_it_is_taken_again(tmp_path: Path) -> None:
    with desk(tmp_path) as it:
        it.connected(ControlMode.DIRECT, coupling_id=3)
        it.console.submit(intents.Hand((0.1, 0.1), 0.0))
        it.robot.wait_for(OperatorInput, 1)
        it.robot.report(ControlMode.HOLD)
        it.until(lambda p: p.mode is ControlMode.HOLD)
        moved = []
        it.console._place.hand = lambda *at: moved.append(at)  # pyright: ignore[reportAttributeAccessIssue]
        it.console.submit(intents.Hand((0.2, 0.1), 0.1))
        it.console.submit(intents.Hand((0.3, 0.1), 0.2, released=True))
        it.console.submit(intents.Hand((0.4, 0.1), 0.3))
        it.console.submit(intents.Choose("nothing"))
        it.told("choose: refused")
        assert [(point, released) for point, _, released in moved] == [
            ((0.3, 0.1), True),
            ((0.4, 0.1), False),
        ]
        assert len(it.robot.heard(OperatorInput)) == 1


def test_a9_a_restarted_site_asks_the_robot_what_it_has_before_it_says_anything(tmp_path: Path) -> None:
    with desk(tmp_path) as it:
        it.connected()
        teach(it)
        it.console.submit(intents.SendModel())
        sha256 = it.until(lambda p: p.robot_model is not None).confirmed_sha256
    with desk(tmp_path) as it:
        it.robot.models.add(sha256)
        it.connected()
        it.until(lambda p: p.confirmed_sha256 == sha256)
        assert [transfer.content for transfer in it.robot.heard(ModelTransfer)] == [b""]
    with desk(tmp_path) as it:
        it.connected()
        it.robot.wait_for(ModelTransfer)
        picture = it.until(lambda p: not p.standing.asking)
        assert picture.standing.differs and not picture.sending_model
        assert [transfer.content for transfer in it.robot.heard(ModelTransfer)] == [b""]


def test_a13_one_press_of_load_samples_is_one_revision_is_undone_at_once_and_not_added_twice(
    tmp_path: Path,
) -> None:
    with desk(tmp_path) as it:
        it.connected()
        teach(it)
        mine = it.picture.learned
        it.console.submit(intents.LoadSamples())
        picture = it.until(lambda p: p.n_demonstrations == 4)
        assert [len(each.demonstrations) for each in picture.revisions] == [1, 4]
        it.console.submit(intents.LoadSamples())
        it.told("load samples: refused: they are learned already")
        assert it.picture.n_demonstrations == 4
        it.console.submit(intents.Undo())
        picture = it.until(lambda p: p.n_demonstrations == 1)
        it.told("the last 3 demonstrations were undone")
        assert picture.learned is not None and mine is not None and picture.learned.sha256 == mine.sha256
