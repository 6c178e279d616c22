"""The action line offers the one to four actions of the present state, and the steps say where the job stands."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from msgspec import structs

from farhand.common.mode_table import ControlMode, Phase
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.view.panels.actions import offered, step, steps_html
from farhand.local_site.view.panels.words.advice import advice
from farhand.local_site.view.panels.words.controls import Label
from farhand.local_site.view.panels.words.lists import ROLE_WORDS
from farhand.local_site.view.panels.words.scripts import in_narrow_window
from farhand.local_site.view.sessions import Role
from tests.local_site.view.panels.test_truth import LOST, OK, ROBOT_IN


def labels(picture: ConsoleState, mode: ControlMode, phase: Phase = Phase.NONE, **changes: Any) -> list[str]:
    robot = structs.replace(ROBOT_IN, mode=mode, phase=phase)
    return [spec.label for spec in offered(replace(picture, robot=robot, **changes))]


def test_each_mode_has_its_next_step_first_and_at_most_four_actions(taught: ConsoleState) -> None:
    first = {
        ControlMode.DISARMED: "Arm", ControlMode.HOLD: "Preview", ControlMode.DIRECT: "Clutch",
        ControlMode.AUTONOMOUS: "Pause", ControlMode.PAUSED: "Resume", ControlMode.STOPPED: "Reset",
    }  # fmt: skip
    for mode, label in first.items():
        phase = Phase.APPROACHING if mode is ControlMode.AUTONOMOUS else Phase.NONE
        shown = labels(taught, mode, phase)
        assert shown[0] == label and len(shown) <= 4, (mode, shown)
    assert labels(taught, ControlMode.HOLD, plan_id=3)[0] == "Execute"
    assert labels(taught, ControlMode.AUTONOMOUS, Phase.APPROACHING) == ["Pause", "Abort"]
    assert labels(taught, ControlMode.AUTONOMOUS, Phase.ARRIVED) == ["Retract", "Clutch"]


def test_a10_without_a_link_nothing_is_offered_that_could_only_be_refused_later(taught: ConsoleState) -> None:
    for mode in ControlMode:
        assert labels(taught, mode, link=LOST) == []
        lost = replace(taught, robot=structs.replace(ROBOT_IN, mode=mode), link=LOST)
        assert "only STOP is sent, until it arrives" in advice(lost)


def test_while_a_demonstration_is_recorded_it_is_ended_or_discarded(taught: ConsoleState) -> None:
    assert labels(taught, ControlMode.DISARMED, recording=True) == ["End", "Undo"]
    missed = labels(taught, ControlMode.DISARMED, recording=True, miss="44 mm beside the bore")
    assert missed == ["End", "Keep anyway", "Undo"]


def test_nothing_taught_offers_to_record_or_to_load_samples(nothing_yet: ConsoleState) -> None:
    shown = labels(replace(nothing_yet, link=OK, in_control=True), ControlMode.DISARMED)
    assert shown == ["Record", "Load samples"]


def test_the_steps_are_done_present_or_locked_with_the_reason(taught: ConsoleState) -> None:
    armed = replace(taught, robot=structs.replace(ROBOT_IN, mode=ControlMode.HOLD, phase=Phase.NONE))
    assert step(armed) == 3 and step(replace(armed, plan_id=3)) == 4
    html = steps_html(armed)
    assert html.count("✓") == 3 and 'aria-current="step"' in html
    assert "Locked: first preview what it will do." in html


def test_a_narrow_window_advises_what_it_has_and_says_what_needs_a_larger_one(taught: ConsoleState) -> None:
    larger = {
        (ControlMode.AUTONOMOUS, Phase.APPROACHING): False, (ControlMode.PAUSED, Phase.NONE): False,
        (ControlMode.AUTONOMOUS, Phase.SEATED): True, (ControlMode.DIRECT, Phase.NONE): True,
        (ControlMode.HOLD, Phase.NONE): True, (ControlMode.DISARMED, Phase.NONE): True,
        (ControlMode.STOPPED, Phase.NONE): True,
    }  # fmt: skip
    for (mode, phase), needed in larger.items():
        words = advice(replace(taught, robot=structs.replace(ROBOT_IN, mode=mode, phase=phase)))
        narrow = in_narrow_window(words)
        assert narrow.startswith(words) and narrow.endswith("in a larger window.") is needed, (mode, narrow)
    for label in set(Label) - {Label.STOP, Label.PAUSE, Label.RESUME, Label.ABORT}:
        assert in_narrow_window(f"Press {label}.").endswith("in a larger window."), label
    assert in_narrow_window("Push on, by the key I: 5 mm to go.").endswith("in a larger window.")
    assert in_narrow_window(ROLE_WORDS[Role.WATCHING]).endswith("in a larger window.")
    for there in (ROLE_WORDS[Role.FREE], "Press STOP again.", advice(replace(taught, link=LOST)), ""):
        assert in_narrow_window(there) == there
