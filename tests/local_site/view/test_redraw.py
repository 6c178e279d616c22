"""When the page is drawn anew."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from msgspec import structs

from farhand.common.mode_table import ControlMode, Phase
from farhand.common.wire.messages import ArmState, Stamp, Telemetry
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.exchange.notices import Notice
from farhand.local_site.view.redraw import AT_REST_S, WORDS_S, Extent, Redraw
from tests.local_site.robot_end import TASK, desk

ROBOT = Telemetry(
    seq=1, stamp=Stamp("boot", 1), mode=ControlMode.DISARMED, position_m=(0.5, 0.0, 0.4),
    frame_origin_m=(0.7, 0.0, 0.3), frame_rotation_rad=(0.0, 0.0, 0.1),
    arm=ArmState((0.0, 0.0, 0.0), (0.1, 0.2, 0.3, 0.4, 0.5, 0.6), 0.0, 0),
)  # fmt: skip


@pytest.fixture(scope="module")
def at_rest(tmp_path_factory: pytest.TempPathFactory) -> ConsoleState:
    folder: Path = tmp_path_factory.mktemp("library")
    with desk(folder, TASK) as it:
        return replace(it.picture, robot=ROBOT)


def drawn_at_once(before: ConsoleState, after: ConsoleState) -> bool:
    redraw = Redraw()
    assert redraw.due(before, 0.0)
    return redraw.due(after, 0.1 * AT_REST_S) is not Extent.NOTHING


def reported(picture: ConsoleState, **changes: object) -> ConsoleState:
    return replace(picture, robot=structs.replace(ROBOT, seq=2, stamp=Stamp("boot", 2), **changes))


def test_at_rest_it_is_drawn_only_now_and_then(at_rest: ConsoleState) -> None:
    redraw = Redraw()
    times_s = [0.05 * AT_REST_S * k for k in range(81)]
    assert sum(redraw.due(reported(at_rest), time_s) > 0 for time_s in times_s) <= 5


def test_what_an_operator_must_see_is_drawn_at_once(at_rest: ConsoleState) -> None:
    arm = ROBOT.arm
    assert isinstance(arm, ArmState)
    for after in (
        reported(at_rest, mode=ControlMode.HOLD),
        reported(at_rest, component=3),
        reported(at_rest, waiting=True),
        reported(at_rest, position_m=(0.5, 0.0, 0.401)),
        reported(at_rest, frame_origin_m=(0.7, 0.0, 0.303)),
        reported(at_rest, arm=structs.replace(arm, joints_rad=(0.1, 0.2, 0.3, 0.4, 0.5, 0.601))),
        replace(at_rest, notices=(Notice(0.0, "arm", "refused", good=False),)),
        replace(at_rest, recording=True),
        replace(at_rest, robot=None),
    ):
        assert drawn_at_once(at_rest, after)


def test_while_only_poses_change_the_picture_follows_each_and_the_words_some(at_rest: ConsoleState) -> None:
    redraw, extents = Redraw(), []
    for step in range(40):
        pose = (0.5 + 0.001 * step, 0.0, 0.4)
        extents.append(redraw.due(reported(at_rest, position_m=pose), 0.25 * WORDS_S * step))
    assert Extent.NOTHING not in extents
    assert 8 <= extents.count(Extent.ALL) <= 10


def test_a_change_beside_a_motion_redraws_the_words_at_once(at_rest: ConsoleState) -> None:
    redraw = Redraw()
    assert redraw.due(at_rest, 0.0) is Extent.ALL
    moved = reported(at_rest, position_m=(0.6, 0.0, 0.4))
    assert redraw.due(moved, 0.1 * WORDS_S) is Extent.PICTURE
    changed = reported(at_rest, position_m=(0.7, 0.0, 0.4), mode=ControlMode.HOLD)
    assert redraw.due(changed, 0.2 * WORDS_S) is Extent.ALL


def test_the_noise_of_what_is_seen_is_no_motion(at_rest: ConsoleState) -> None:
    noisy = reported(at_rest, frame_origin_m=(0.701, 0.0, 0.299), frame_rotation_rad=(0.0, 0.01, 0.1))
    assert not drawn_at_once(at_rest, noisy)


def test_the_ghost_goes_on_without_reports_until_the_end(at_rest: ConsoleState) -> None:
    going = reported(at_rest, mode=ControlMode.AUTONOMOUS, phase=Phase.APPROACHING)
    assert drawn_at_once(going, going)
    there = reported(at_rest, mode=ControlMode.AUTONOMOUS, phase=Phase.SEATED)
    assert not drawn_at_once(there, there)


def test_a_page_that_changed_itself_is_drawn_at_once(at_rest: ConsoleState) -> None:
    redraw = Redraw()
    assert redraw.due(at_rest, 0.0)
    redraw.soon()
    assert redraw.due(at_rest, 0.1 * AT_REST_S)
