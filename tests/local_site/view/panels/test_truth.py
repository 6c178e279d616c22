"""What the page says is what is known: old is said to be old, and a refusal is told where one looks."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest
from msgspec import structs

from farhand.common.mode_table import Action, ControlMode, Phase
from farhand.common.wire.messages import Stamp, Telemetry
from farhand.common.wire.reason_words import sentence
from farhand.common.wire.reasons import Code
from farhand.local_site.console import intents
from farhand.local_site.console.console_state import ConsoleState, Pending
from farhand.local_site.console.intent_permission import command_refusal
from farhand.local_site.exchange.notices import Notice
from farhand.local_site.exchange.report_age import LinkHealth, LinkView
from farhand.local_site.exchange.stop_sender import StopStatus
from farhand.local_site.view.panels.buttons import END, ROBOT
from farhand.local_site.view.panels.status_strip import _alarm, _cells
from farhand.local_site.view.panels.words.advice import advice, miss_words, refusal
from farhand.local_site.view.panels.words.status import silence_words
from farhand.local_site.workcell.held_arm import HeldArm
from tests.cells import JACO
from tests.local_site.robot_end import desk

ROBOT_IN = Telemetry(
    seq=1,
    stamp=Stamp("boot", 1),
    mode=ControlMode.AUTONOMOUS,
    position_m=(0.5, 0.5),
    frame_origin_m=(0.7, 0.3),
)
ARM = HeldArm("insert", JACO, 0).view()
LOST = LinkView(LinkHealth.LOST, 9.7, 0.6, 10.0, 100, 0)
OK = LinkView(LinkHealth.OK, 0.0, 0.6, 0.3, 100, 0)


def seen(base: ConsoleState, **changes: object) -> ConsoleState:
    return replace(base, now_s=100.0, robot=ROBOT_IN, link=LOST, **changes)  # pyright: ignore[reportArgumentType]


def test_a6_a_stop_that_was_not_delivered_claims_nothing_about_now(nothing_yet: ConsoleState) -> None:
    stop = StopStatus(pressed_s=98.0, received=False, standing=False)
    words = _alarm(seen(nothing_yet, stop=stop), None, 100.0)
    assert "STOP NOT DELIVERED 2 s: the robot was AUTONOMOUS when last heard 10 s ago" in words
    assert "continues" not in words
    assert "STOP NOT DELIVERED 2 s<" in _alarm(replace(nothing_yet, now_s=100.0, stop=stop), None, 100.0)


def test_a4_a_preview_says_how_long_it_counts(nothing_yet: ConsoleState) -> None:
    picture = seen(nothing_yet, plan_id=3, plan_received_s=92.0)
    assert "preview: 52 s left" in _cells(picture, "10 s", None, 100.0, "")
    assert "preview" not in _cells(replace(picture, plan_id=0), "10 s", None, 100.0, "")
    assert "fh-insecure" not in _cells(picture, "10 s", None, 100.0, "")
    insecure = _cells(picture, "10 s", None, 100.0, "NOT ENCRYPTED")  # in red, beside the state of the link
    assert re.search('data-tp="security" class="fh-insecure"[^>]*>NOT ENCRYPTED<', insecure)


def notice(
    what: str, text: str, at_s: float, good: bool = False, who: str = "", code: str = ""
) -> Notice:  # fmt: skip
    return Notice(at_s, what, text, good=good, who=who, code=code)


@pytest.mark.parametrize(
    ("notices", "told"),
    [
        (
            [notice("execute", "refused: too late", 95.0, code=Code.TOO_OLD)],
            "Execute: refused: too late. Press it again.",
        ),
        (
            [notice("abort", "NOT DELIVERED: the robot did not answer", 99.0, code=Code.NOT_DELIVERED)],
            "Press it again.",
        ),
        ([notice("load samples", "refused: not now", 99.0)], "Load samples: refused: not now."),
        ([notice("execute", "refused: too late", 80.0)], ""),
        ([notice("execute", "refused: x", 95.0), notice("execute", "done", 97.0, good=True)], ""),
        ([notice("execute", "refused: x", 95.0, who="bob")], ""),
        ([notice("guard", "the force limit", 99.0)], ""),
        ([], ""),
    ],
)
def test_a10_a_refusal_is_told_where_the_next_step_is(
    nothing_yet: ConsoleState, notices: list[Notice], told: str
) -> None:
    words = refusal(seen(nothing_yet, notices=tuple(notices)))
    assert told in words and bool(words) is bool(told)


def test_who_or_what_stopped_the_robot_is_told_where_the_next_step_is(nothing_yet: ConsoleState) -> None:
    stopped = structs.replace(ROBOT_IN, mode=ControlMode.STOPPED)
    state = replace(
        nothing_yet, now_s=100.0, robot=stopped, link=OK, notices=(notice("stopped", "stop by ann", 90.0),)
    )
    assert advice(state) == "Stopped: stop by ann. Press Reset when it is safe to go on."


def test_a5_a_miss_is_told_beside_the_way_on_and_end_is_not_advised(nothing_yet: ConsoleState) -> None:
    miss = "119 mm before the receptacle"
    told = notice("end", "it ends there", 99.0, good=True)
    state = replace(nothing_yet, now_s=100.0, recording=True, miss=miss, notices=(told,), own_arm=ARM)
    assert refusal(state) == ""
    assert miss_words(state) == f"Not learned: it ends {miss}. Undo it, Keep anyway, or go on: "
    assert END.waits(state)
    assert not END.waits(replace(state, own_arm=None))  # a board does not know when a stroke is over


@pytest.mark.parametrize("action", [Action.PREVIEW, Action.EXECUTE])
def test_a3_what_is_previewed_and_executed_is_the_model_that_is_shown(
    nothing_yet: ConsoleState, action: Action
) -> None:
    one, other = "a" * 64, "b" * 64
    for learned, has in ((one, True), (other, False)):
        task = replace(nothing_yet.tasks[0], learned_sha256=learned, confirmed_sha256=one, robot_does=True)
        picture = replace(
            nothing_yet, robot=structs.replace(ROBOT_IN, mode=ControlMode.HOLD), tasks=(task,), confirmed_sha256=one,
            in_control=True, plan_id=3,
        )  # fmt: skip
        button = next(spec for spec in ROBOT if spec.label.lower() == action)
        assert button.enabled(picture) is has
        why = command_refusal(action, picture)
        assert why is None if has else "Send model" in sentence(why)


def test_a14_a_recording_that_is_thrown_away_is_not_called_a_demonstration(tmp_path: Path) -> None:
    with desk(tmp_path) as it:
        it.console.submit(intents.RecordDemonstration())
        it.console.submit(intents.Undo())
        it.told("undo: the recording under way was discarded")


@pytest.mark.parametrize(
    ("mode", "phase", "policy", "becomes", "short"),
    [
        ("DISARMED", "", "continue", "DISARMED: it stays so", "stands"),
        ("HOLD", "", "retract", "HOLD: it stays so", "stands"),
        ("PAUSED", "", "retract", "PAUSED: it stays so", "stands"),
        ("STOPPED", "", "continue", "STOPPED: it stays so", "stands"),
        ("DIRECT", "", "continue", "DIRECT: without the link no hand moves it, and it holds", "holds"),
        ("AUTONOMOUS", "approaching", "continue", "AUTONOMOUS, approaching: its task lets an execution go on to its end", "goes on"),
        ("AUTONOMOUS", "recovering", "continue", "its task lets an execution go on to its end", "goes on"),
        ("AUTONOMOUS", "approaching", "hold", "its task pauses an execution", "pauses"),
        ("AUTONOMOUS", "arrived", "continue", "arrived: without the link it stays there and tracks the U", "goes on"),
        ("AUTONOMOUS", "seated", "hold", "seated: its task pauses an execution", "pauses"),
        ("AUTONOMOUS", "arrived", "retract", "arrived: its task has an execution retract", "retracts"),
        ("AUTONOMOUS", "retracting", "hold", "retracting: this ends without the link as with it", "goes on"),
        ("AUTONOMOUS", "going to ready", "retract", "this ends without the link as with it", "goes on"),
        ("AUTONOMOUS", "backing off", "continue", "this ends without the link as with it", "goes on"),
    ],
)  # fmt: skip
def test_without_a_link_the_page_says_what_was_last_heard_and_what_that_mode_becomes(
    nothing_yet: ConsoleState, mode: str, phase: str, policy: str, becomes: str, short: str
) -> None:
    task = structs.replace(nothing_yet.task, lost_link=policy, retract_m=(0.0, 0.1))
    robot = structs.replace(ROBOT_IN, mode=ControlMode[mode], phase=Phase(phase))
    state = replace(seen(nothing_yet, task=task), robot=robot)
    words = advice(state)
    assert words.startswith("Nothing new is heard of the robot: only STOP is sent") and becomes in words
    assert f"When last heard it was {mode}" in words
    if not (mode == "AUTONOMOUS" and phase in ("approaching", "recovering")):
        assert "to its end" not in words
    assert silence_words(state, 100.0) == "silent for 9 s"
    assert silence_words(replace(state, link=OK), 100.0) == f"if lost: {short}"


def test_without_a_link_what_was_sent_before_is_not_forgotten(nothing_yet: ConsoleState) -> None:
    sent = {Action.EXECUTE: Pending("1", 95.0), Action.STOP: Pending("2", 99.0)}
    held = structs.replace(ROBOT_IN, mode=ControlMode.HOLD)
    state = replace(seen(nothing_yet, pending=sent), robot=held)
    assert advice(state).endswith("It may have received since: execute.")


def test_an_execution_is_not_said_to_go_on_where_its_task_ends_it_with_the_link(
    nothing_yet: ConsoleState,
) -> None:
    robot = structs.replace(ROBOT_IN, phase=Phase.APPROACHING)
    for policy, told in (("continue", "also without the link"), ("hold", "pauses"), ("retract", "retracts")):
        task = structs.replace(nothing_yet.task, lost_link=policy, retract_m=(0.0, 0.1))
        assert told in advice(replace(nothing_yet, now_s=100.0, robot=robot, link=OK, task=task))
