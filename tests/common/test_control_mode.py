from __future__ import annotations

import itertools

import pytest

from common.control_mode import Action, ControlMode, Phase, allowed_actions, mode_after, modes_allowing

# The table of the specification in its own words: what each mode allows, and where it leads.
ALLOWED = {
    "disarmed": {"arm": "hold", "disarm": "disarmed", "stop": "stopped"},
    "hold": {
        "couple": "direct",
        "preview": "hold",
        "execute": "autonomous",
        "disarm": "disarmed",
        "stop": "stopped",
    },
    "direct": {"clutch": "hold", "execute": "autonomous", "disarm": "disarmed", "stop": "stopped"},
    "autonomous": {"abort": "hold", "disarm": "disarmed", "stop": "stopped"},
    "stopped": {"reset": "disarmed", "stop": "stopped"},
}
ALSO_ONCE_ARRIVED = {"clutch": "hold", "preview": "autonomous", "execute": "autonomous"}

EVERYTHING = list(itertools.product(ControlMode, Phase, Action))


def expected(mode: ControlMode, phase: Phase, action: Action) -> str | None:
    row = dict(ALLOWED[mode.value])
    if mode.value == "autonomous" and phase.value == "arrived":
        row |= ALSO_ONCE_ARRIVED
    return row.get(action.value)


@pytest.mark.parametrize(("mode", "phase", "action"), EVERYTHING)
def test_every_action_in_every_mode_and_phase_does_what_the_table_says(mode, phase, action):
    after = mode_after(mode, phase, action)
    assert (after.value if after else None) == expected(mode, phase, action)


@pytest.mark.parametrize("mode", ControlMode)
@pytest.mark.parametrize("phase", Phase)
def test_the_allowed_actions_are_those_that_lead_somewhere(mode, phase):
    assert allowed_actions(mode, phase) == {a for a in Action if expected(mode, phase, a) is not None}


def test_only_direct_is_coupled():
    assert [mode for mode in ControlMode if mode.coupled] == [ControlMode.DIRECT]


def test_disarmed_and_stopped_are_reachable_from_everywhere():
    for mode, phase in itertools.product(ControlMode, Phase):
        assert mode_after(mode, phase, Action.STOP) is ControlMode.STOPPED
        by_disarming = mode_after(mode, phase, Action.DISARM)
        by_resetting = mode_after(mode, phase, Action.RESET)
        assert ControlMode.DISARMED in (by_disarming, by_resetting)


def test_nothing_leads_from_stopped_to_motion():
    leads_to = {mode_after(ControlMode.STOPPED, phase, a) for phase in Phase for a in Action}
    assert leads_to == {None, ControlMode.STOPPED, ControlMode.DISARMED}


def test_a_refusal_can_name_the_modes_in_which_an_action_is_allowed():
    assert modes_allowing(Action.COUPLE) == "HOLD"
    assert modes_allowing(Action.CLUTCH) == "DIRECT, AUTONOMOUS once arrived"
