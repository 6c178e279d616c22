from __future__ import annotations

import itertools

import pytest

from farhand.common.mode_table import (
    TABLE,
    Action,
    ControlMode,
    Guard,
    Phase,
    allowed_actions,
    mode_after,
    modes_allowing,
)

# The table of the specification in its own words: what each mode allows, and where it leads.
ALLOWED = {
    "disarmed": {"arm": "hold", "disarm": "disarmed", "stop": "stopped"},
    "hold": {
        "couple": "direct",
        "preview": "hold",
        "execute": "autonomous",
        "retract": "autonomous",
        "go to ready": "autonomous",
        "disarm": "disarmed",
        "stop": "stopped",
    },
    "direct": {
        "clutch": "hold",
        "execute": "autonomous",
        "record": "direct",
        "end recording": "direct",
        "disarm": "disarmed",
        "stop": "stopped",
    },
    "autonomous": {"pause": "paused", "abort": "hold", "disarm": "disarmed", "stop": "stopped"},
    "paused": {
        "resume": "autonomous",
        "abort": "hold",
        "preview": "paused",
        "retract": "autonomous",
        "go to ready": "autonomous",
        "disarm": "disarmed",
        "stop": "stopped",
    },
    "stopped": {"reset": "disarmed", "stop": "stopped"},
}
for mode, row in ALLOWED.items():
    row["set pace"] = mode
ALSO_AT_THE_END = {
    "clutch": "hold",
    "preview": "autonomous",
    "execute": "autonomous",
    "retract": "autonomous",
    "go to ready": "autonomous",
}
GUARDS = {
    "coupling ended": {"direct": "hold"},
    "manoeuvre ended": {"autonomous": "hold"},
    "force limit": {"direct": "autonomous", "autonomous": "autonomous"},
    "jammed too often": {"autonomous": "hold"},
    "perception lost": {"autonomous": "paused"},
    "link lost: hold": {"autonomous": "paused"},
    "link lost: retract": {"autonomous": "autonomous", "paused": "autonomous"},
    "fault": dict.fromkeys(ALLOWED, "stopped"),
}


def expected(mode: ControlMode, phase: Phase, action: Action) -> str | None:
    row = dict(ALLOWED[mode.value])
    if mode.value == "autonomous" and phase.value in ("arrived", "seated"):
        row |= ALSO_AT_THE_END
    return row.get(action.value)


@pytest.mark.parametrize(("mode", "phase"), list(itertools.product(ControlMode, Phase)))
def test_every_action_in_every_mode_and_phase_does_what_the_table_says(mode, phase):
    for action in Action:
        after = mode_after(mode, phase, action)
        assert (after.value if after else None) == expected(mode, phase, action), action
    assert allowed_actions(mode, phase) == {a for a in Action if expected(mode, phase, a) is not None}


@pytest.mark.parametrize("guard", Guard)
def test_every_guard_in_every_mode_leads_where_the_table_says(guard):
    for mode, phase in itertools.product(ControlMode, Phase):
        after = mode_after(mode, phase, guard)
        assert (after.value if after else None) == GUARDS[guard.value].get(mode.value)


def test_every_action_and_every_guard_has_one_row():
    assert set(TABLE) == set(Action) | set(Guard)


def test_a_cause_that_leads_to_a_motion_says_what_the_robot_is_then_at():
    for cause, row in TABLE.items():
        leads_to_motion = row.leads_to is ControlMode.AUTONOMOUS and cause is not Action.RESUME
        assert (row.phase is not Phase.NONE) == leads_to_motion, cause


def test_only_direct_is_coupled():
    assert [mode for mode in ControlMode if mode.coupled] == [ControlMode.DIRECT]


def test_disarmed_and_stopped_are_reachable_from_everywhere():
    for mode, phase in itertools.product(ControlMode, Phase):
        assert mode_after(mode, phase, Action.STOP) is ControlMode.STOPPED
        by_disarming = mode_after(mode, phase, Action.DISARM)
        by_resetting = mode_after(mode, phase, Action.RESET)
        assert ControlMode.DISARMED in (by_disarming, by_resetting)


def test_nothing_leads_from_stopped_to_motion():
    causes = [*Action, *Guard]
    leads_to = {mode_after(ControlMode.STOPPED, phase, cause) for phase in Phase for cause in causes}
    assert leads_to == {None, ControlMode.STOPPED, ControlMode.DISARMED}


def test_a_refusal_can_name_the_modes_in_which_an_action_is_allowed():
    assert modes_allowing(Action.COUPLE) == "HOLD"
    assert modes_allowing(Action.CLUTCH) == "DIRECT, AUTONOMOUS at the end of its motion"
