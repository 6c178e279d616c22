from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from msgspec import structs

from farhand.common.mode_table import Action, ControlMode, Phase, mode_after
from farhand.common.wire.messages import Stamp, Telemetry
from farhand.common.wire.reason_words import sentence
from farhand.local_site.console import intents
from farhand.local_site.console.console_state import ConsoleState, Pending
from farhand.local_site.console.intent_permission import command_refusal, refusal_of
from farhand.local_site.exchange.stop_sender import StopStatus
from farhand.local_site.workcell.hand_motion import Nudge
from tests.local_site.console.test_console import teach
from tests.local_site.robot_end import TASK, Desk, desk

SHA = "a" * 64
PREVIEWED = structs.replace(TASK, require_preview=True)
ROBOT = Telemetry(
    seq=1, stamp=Stamp("boot", 1), mode=ControlMode.HOLD, position_m=(0.5, 0.5), frame_origin_m=(0.7, 0.3)
)  # fmt: skip


@pytest.fixture(scope="module")
def nothing_yet(tmp_path_factory: pytest.TempPathFactory) -> ConsoleState:
    """What a console shows before the robot has reported."""
    folder: Path = tmp_path_factory.mktemp("library")
    with desk(folder, TASK) as it:
        return it.picture


def seen(
    base: ConsoleState, mode: ControlMode = ControlMode.HOLD, phase: Phase = Phase.NONE, **changes
) -> ConsoleState:
    robot = structs.replace(ROBOT, mode=mode, phase=phase)
    return replace(base, **({"robot": robot, "confirmed_sha256": SHA, "in_control": True} | changes))


def refusal(action: Action, picture: ConsoleState, shown: ControlMode | None = None) -> str:
    return sentence(command_refusal(action, picture, shown))


def test_before_the_first_report_everything_is_refused_but_a_stop(nothing_yet: ConsoleState):
    for action in set(Action) - {Action.STOP}:
        assert "not reported" in refusal(action, nothing_yet)


@pytest.mark.parametrize("mode", ControlMode)
@pytest.mark.parametrize("phase", [Phase.NONE, Phase.ARRIVED])
def test_it_refuses_what_the_table_forbids_and_nothing_else(nothing_yet, mode, phase):
    for action in Action:
        forbidden = mode_after(mode, phase, action) is None
        assert bool(refusal(action, seen(nothing_yet, mode, phase))) is forbidden


def test_a_click_on_a_page_that_was_behind_is_refused(nothing_yet: ConsoleState):
    picture = seen(nothing_yet, ControlMode.AUTONOMOUS)
    assert "page was behind" in refusal(Action.ABORT, picture, shown=ControlMode.HOLD)
    assert not refusal(Action.ABORT, picture, shown=ControlMode.AUTONOMOUS)


def test_a_second_click_while_the_first_is_under_way_is_refused(nothing_yet: ConsoleState):
    picture = seen(nothing_yet, pending={Action.COUPLE: Pending("c", 0.0)})
    assert "under way" in refusal(Action.COUPLE, picture)
    assert not refusal(Action.DISARM, picture)


@pytest.mark.parametrize(
    "stop",
    [
        StopStatus(0.0),
        StopStatus(0.0, received=True),
        StopStatus(0.0, received=True, standing=True),
        StopStatus(0.0, received=True, standing=True, reported=ControlMode.AUTONOMOUS),
    ],
)
def test_reset_waits_for_the_own_stop(nothing_yet: ConsoleState, stop: StopStatus):
    assert "your own stop" in refusal(Action.RESET, seen(nothing_yet, ControlMode.STOPPED, stop=stop))
    settled = StopStatus(0.0, received=True, standing=True, reported=ControlMode.STOPPED)
    assert not refusal(Action.RESET, seen(nothing_yet, ControlMode.STOPPED, stop=settled))


def test_preview_and_execute_wait_for_a_confirmed_model(nothing_yet: ConsoleState):
    for action in (Action.PREVIEW, Action.EXECUTE):
        assert "send it first" in refusal(action, seen(nothing_yet, confirmed_sha256=""))


def test_nobody_couples_while_recording(nothing_yet: ConsoleState):
    assert "recorded" in refusal(Action.COUPLE, seen(nothing_yet, recording=True))


def test_execute_waits_for_a_preview_where_the_task_demands_one(nothing_yet: ConsoleState):
    assert not refusal(Action.EXECUTE, seen(nothing_yet, plan_id=0))
    assert "press Preview first" in refusal(Action.EXECUTE, seen(nothing_yet, plan_id=0, task=PREVIEWED))
    assert not refusal(Action.EXECUTE, seen(nothing_yet, plan_id=3, task=PREVIEWED))


LOCAL: tuple[intents.Intent, ...] = (
    intents.RecordDemonstration(),
    intents.EndDemonstration(anyway=True),
    intents.Undo(),
    intents.LoadSamples(),
    intents.Recover(),
    intents.StartAnew(),
    intents.SelectRevision(1),
    intents.SelectRevision(2),
    intents.Delete(1),
    intents.Delete(9),
    intents.ResetArm(),
    intents.Align(),
    intents.Centre(),
    intents.StepArm(Nudge((0.005, 0.0, 0.0))),
    intents.SendModel(),
    intents.SendLibrary(),
    intents.Choose("nowhere"),
)


def taught_twice(it: Desk) -> None:
    teach(it)
    teach(it)


def recording(it: Desk) -> None:
    taught_twice(it)
    it.console.submit(intents.RecordDemonstration())
    for k in range(20):
        it.console.submit(intents.Hand((0.1 + 0.02 * k, 0.2), 0.02 * k))
    it.until(lambda p: p.recording and len(p.strokes) == 3 and len(p.strokes[2]) == 20)


@pytest.mark.parametrize("intent", LOCAL, ids=lambda intent: f"{intent.label}-{intent}"[:40])
@pytest.mark.parametrize(
    "prepare", [lambda it: None, taught_twice, recording], ids=["nothing", "taught", "recording"]
)
def test_the_rule_foretells_what_the_console_and_its_library_do(
    tmp_path: Path, prepare, intent: intents.Intent
):
    with desk(tmp_path) as it:
        it.connected(ControlMode.HOLD)
        prepare(it)
        foretold, n_told = refusal_of(intent, it.picture), len(it.picture.notices)
        it.console.submit(intent)
        told = it.until(lambda p: len(p.notices) > n_told).notices[n_told]
        assert told.text.startswith("refused: ") is (foretold is not None), told
        assert foretold is None or told.text == f"refused: {sentence(foretold)}"
