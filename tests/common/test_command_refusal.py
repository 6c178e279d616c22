from __future__ import annotations

from dataclasses import replace

import pytest

from farhand.common.command_refusal import Situation, refusal
from farhand.common.mode_table import Action, ControlMode, Phase, allowed_actions
from farhand.common.wire.reasons import Code, because

READY = Situation(
    mode=ControlMode.HOLD, phase=Phase.NONE, why_not_in_control=None, why_no_model=None, is_previewed=True,
    needs_preview=True, can_retract=True,
)  # fmt: skip
HELD = because(Code.HELD, held_s=3.0, site="bob")
LACKING = because(Code.NO_MODEL)


def code(action: Action, situation: Situation) -> str:
    reason = refusal(action, situation)
    return "" if reason is None else reason.code


@pytest.mark.parametrize("mode", ControlMode)
@pytest.mark.parametrize("phase", [Phase.NONE, Phase.SEATED, Phase.APPROACHING])
def test_with_all_else_in_order_the_table_of_modes_decides(mode: ControlMode, phase: Phase):
    situation = replace(READY, mode=mode, phase=phase, needs_preview=False)
    for action in Action:
        expected = "" if action in allowed_actions(mode, phase) else Code.WRONG_MODE
        assert code(action, situation) == expected


@pytest.mark.parametrize("mode", ControlMode)
def test_stop_is_never_refused_and_without_control_all_else_is(mode: ControlMode):
    situation = replace(READY, mode=mode, why_not_in_control=HELD)
    for action in Action:
        assert code(action, situation) == ("" if action is Action.STOP else Code.HELD)


@pytest.mark.parametrize(
    ("action", "changes", "expected"),
    [
        (Action.RETRACT, {"can_retract": False}, Code.NO_RETRACT),
        (Action.PREVIEW, {"why_no_model": LACKING}, Code.NO_MODEL),
        (Action.EXECUTE, {"why_no_model": LACKING}, Code.NO_MODEL),
        (Action.EXECUTE, {"is_previewed": False}, Code.NOT_PREVIEWED),
        (Action.EXECUTE, {"is_previewed": False, "needs_preview": False}, ""),
        (Action.EXECUTE, {"mode": ControlMode.DIRECT}, Code.CLUTCH_FIRST),
        (Action.EXECUTE, {"mode": ControlMode.DIRECT, "needs_preview": False}, ""),
        (Action.COUPLE, {"why_no_model": LACKING, "is_previewed": False, "can_retract": False}, ""),
    ],
)
def test_each_condition_concerns_the_actions_that_need_it(action: Action, changes: dict, expected: str):
    assert code(action, replace(READY, **changes)) == expected
