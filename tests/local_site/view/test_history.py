"""History of the session: what is kept of it, what is shown of a moment, and what may be commanded meanwhile."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from msgspec import structs

from farhand.common.mode_table import ControlMode, Phase
from farhand.common.wire.messages import ArmState, Stamp, Telemetry
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.exchange.report_age import LinkHealth
from farhand.local_site.view import history
from farhand.local_site.view.history import AT_REST_S, MOST_MOMENTS, History, as_it_was
from farhand.local_site.view.panels import buttons
from farhand.local_site.view.panels.actions import offered
from farhand.local_site.view.panels.looking_back import Look
from farhand.local_site.view.panels.timeline import timeline_svg
from farhand.local_site.view.panels.words.status import ago_words
from tests.local_site.view.panels.test_truth import LOST, OK, ROBOT_IN
from tests.local_site.view.test_redraw import ROBOT


def report(mode: ControlMode, x_m: float, phase: Phase = Phase.NONE, **more: Any) -> Telemetry:
    return structs.replace(ROBOT, mode=mode, phase=phase, position_m=(x_m, 0.0, 0.4), **more)


def pressing(force_n: float) -> ArmState:
    assert isinstance(ROBOT.arm, ArmState)
    return structs.replace(ROBOT.arm, force_n=force_n)


@pytest.fixture
def heard(nothing_yet: ConsoleState) -> ConsoleState:
    return replace(nothing_yet, link=OK, robot=report(ControlMode.HOLD, 0.5))


def executed(heard: ConsoleState) -> History:
    """HOLD at 0 s, an execution from 10 s to 20 s along 100 mm, then HOLD again, a moment a second."""
    kept = History()
    for second in range(30):
        moving = 10 <= second < 20
        mode = ControlMode.AUTONOMOUS if moving else ControlMode.HOLD
        phase = Phase.APPROACHING if moving else Phase.NONE
        x_m = 0.5 + 0.01 * min(max(second - 10, 0), 9)
        kept.note(replace(heard, robot=report(mode, x_m, phase)), float(second))
    return kept


def test_looking_back_shows_the_robot_as_it_was_and_the_operators_own_as_it_is(heard: ConsoleState) -> None:
    then = executed(heard).at(12.5)
    now = replace(heard, recording=True, robot=report(ControlMode.HOLD, 0.59))
    assert then is not None and then.time_s == 12.0
    shown = as_it_was(now, then)
    assert shown.mode is ControlMode.AUTONOMOUS and shown.robot is then.robot
    assert shown.link.health is LinkHealth.LOST and not shown.plan_id
    assert shown.recording and shown.demonstrations is now.demonstrations


def test_the_trace_is_that_of_the_newest_execution_that_had_begun_then(heard: ConsoleState) -> None:
    kept = executed(heard)
    assert kept.trace(kept.at(5.0)) is None
    half, whole = kept.trace(kept.at(15.0)), kept.trace(kept.newest)
    assert half is not None and whole is not None
    assert len(half) == 6 and len(whole) == 10
    np.testing.assert_allclose(np.linalg.norm(whole[-1, :3] - whole[0, :3]), 0.09, atol=1e-9)


def test_a_retreat_is_not_part_of_the_trace(heard: ConsoleState) -> None:
    kept = executed(heard)
    kept.note(replace(heard, robot=report(ControlMode.AUTONOMOUS, 0.4, Phase.RETRACTING)), 31.0)
    trace = kept.trace(kept.newest)
    assert trace is not None and len(trace) == 10


def test_at_rest_a_moment_a_second_is_kept_and_an_outage_at_once(heard: ConsoleState) -> None:
    kept = History()
    for tick in range(300):
        state = heard if tick < 255 else replace(heard, link=LOST)
        kept.note(state, tick / 30.0)
    moments = kept.since(0.0)
    assert 9 <= len(moments) <= 11
    assert any(not each.heard and each.time_s == pytest.approx(8.5, abs=0.25) for each in moments)
    assert max(b.time_s - a.time_s for a, b in itertools.pairwise(moments)) <= AT_REST_S + 0.1


def test_a_session_of_any_length_is_kept_whole_in_a_bounded_number_of_moments(
    heard: ConsoleState, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert MOST_MOMENTS >= 3600  # an hour at rest, before anything is thinned
    monkeypatch.setattr(history, "MOST_MOMENTS", 100)
    kept = History()
    for second in range(3000):
        kept.note(heard, float(second))
    moments = kept.since(0.0)
    assert moments[0].time_s == 0.0 and len(moments) <= 100
    assert [each.time_s for each in moments[-40:]] == [float(second) for second in range(2960, 3000)]


def test_one_axis_has_mode_component_force_with_its_limit_depth_age_outages_and_the_moment_looked_at(
    heard: ConsoleState,
) -> None:
    kept = History()
    for second in range(20):
        link = LOST if 12 <= second < 15 else OK
        arm = pressing(35.0 if second == 7 else 5.0)
        robot = report(ControlMode.AUTONOMOUS, 0.5, Phase.APPROACHING, component=2, arm=arm)
        kept.note(replace(heard, robot=robot, link=replace(link, age_s=0.4)), float(second))
    svg = timeline_svg(kept.since(0.0), 20.0, 30.0, Look(120.0, 11.0))
    for part in (
        '"fh-lane-autonomous"',
        ">force<",
        '"fh-limit"',
        ">depth<",
        ">age<",
        '"fh-outage"',
        '"fh-then"',
    ):
        assert part in svg, part
    assert ">now<" in svg and ">2 min ago<" in svg


def test_the_timeline_is_drawn_before_the_first_report() -> None:
    assert "<svg" in timeline_svg([], 20.0, 30.0)


def test_no_peak_of_the_force_is_left_out_of_a_long_timeline(heard: ConsoleState) -> None:
    kept = History()
    for second in range(3000):
        arm = pressing(90.0 if second == 1001 else 5.0)
        kept.note(replace(heard, robot=report(ControlMode.HOLD, 0.5, arm=arm)), float(second))
    whole, without = (
        timeline_svg([m for m in kept.since(0.0) if m.force_n != drop], 3000.0, 30.0, Look(3000.0))
        for drop in (None, 90.0)
    )
    assert whole != without and whole.count(",") < 3000


def test_who_looks_at_the_past_is_offered_nothing_that_sets_the_robot_in_motion(heard: ConsoleState) -> None:
    motion = set(buttons.NEED_THE_PRESENT)
    for mode in ControlMode:
        state = replace(heard, in_control=True, robot=structs.replace(ROBOT_IN, mode=mode), plan_id=3)
        assert not motion & set(offered(state, past=True)), mode
    moving = replace(
        heard, in_control=True, robot=report(ControlMode.AUTONOMOUS, 0.5, Phase.APPROACHING, lease="abcd")
    )
    assert [spec.label for spec in offered(moving, past=True)] == ["Pause", "Abort"]


def test_how_long_ago_is_said_in_words() -> None:
    assert [ago_words(s) for s in (0.0, 12.4, 60.0, 200.0, 7260.0)] == [
        "0 s ago", "12 s ago", "1 min ago", "3 min 20 s ago", "2 h 1 min ago",
    ]  # fmt: skip


def test_stamps_of_another_boot_are_other_moments(heard: ConsoleState) -> None:
    kept = executed(heard)
    kept.note(replace(heard, robot=report(ControlMode.DISARMED, 0.5, stamp=Stamp("boot'", 1))), 40.0)
    newest = kept.newest
    assert newest is not None and newest.mode == "DISARMED"
