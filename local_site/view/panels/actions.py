"""Action line: the one to four actions of the present state, the first one filled; steps of the job above it.

An action that is possible but not on the line is in the drawer; an impossible one is not drawn.
"""

from __future__ import annotations

import viser

from farhand.common.mode_table import ControlMode
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.exchange.report_age import LinkHealth
from farhand.local_site.view.panels import buttons
from farhand.local_site.view.panels.buttons import ButtonSpec, OnPress
from farhand.local_site.view.panels.html import Html, element
from farhand.local_site.view.panels.words.controls import LOCKED, STEP_NAMES, STEPS, WHY_LOCKED
from farhand.local_site.view.scene.ghost import preview_miss

_ARMED = (ControlMode.HOLD, ControlMode.DIRECT, ControlMode.AUTONOMOUS, ControlMode.PAUSED)
_EXECUTES = (ControlMode.AUTONOMOUS, ControlMode.PAUSED)


def offered(state: ConsoleState, past: bool = False) -> tuple[ButtonSpec, ...]:
    """Return the actions of the present state, the primary one first; those only that may be pressed or are pending.

    Args:
        state: Present state of the console.
        past: True while the operator looks back: nothing that sets the robot in motion is offered.
    """
    asked = (buttons.HAND_OVER, *_of_state(state))
    allowed = (spec for spec in asked if not (past and spec in buttons.NEED_THE_PRESENT))
    return tuple(spec for spec in allowed if spec.enabled(state) or spec.pending(state))


def _of_state(state: ConsoleState) -> tuple[ButtonSpec, ...]:
    if state.recording:
        ends = buttons.END, buttons.KEEP if state.miss else buttons.ALIGN, buttons.UNDO
        return ends if state.miss else (buttons.CENTRE, *ends)
    if state.link.health is LinkHealth.LOST:
        return ()
    match state.mode:
        case ControlMode.STOPPED:
            return (buttons.RESET,)
        case ControlMode.PAUSED:
            return buttons.RESUME, buttons.ABORT
        case ControlMode.AUTONOMOUS if state.phase.at_end:
            return buttons.RETRACT, buttons.CLUTCH
        case ControlMode.AUTONOMOUS:
            return buttons.PAUSE, buttons.ABORT
        case ControlMode.DIRECT if state.robot_records:
            return buttons.END, buttons.CLUTCH, buttons.UNDO
        case ControlMode.DIRECT:
            return buttons.CLUTCH, buttons.RECORD
    return _at_rest(state)


def _at_rest(state: ConsoleState) -> tuple[ButtonSpec, ...]:
    """Return the actions while nothing moves the robot: the next step of the job first."""
    holds = state.mode is ControlMode.HOLD
    if state.learned is None:
        first = (buttons.RECOVER,) if state.can_recover else ()
        return *first, buttons.RECORD, buttons.LOAD_SAMPLES, buttons.COUPLE
    if state.standing.differs:
        return buttons.SEND_MODEL, buttons.RECORD, buttons.UNDO, buttons.COUPLE
    if not holds:
        return buttons.ASK, buttons.ARM, buttons.RECORD
    if state.plan_id:
        first = (buttons.RECORD, buttons.EXECUTE) if preview_miss(state) else (buttons.EXECUTE,)
        return *first, buttons.PREVIEW, buttons.COUPLE
    return buttons.PREVIEW, buttons.COUPLE, buttons.GO_TO_READY, buttons.DISARM


def step(state: ConsoleState) -> int:
    """Return the number of the present step of the job, from 0; the number of steps once all are done."""
    if state.phase.at_end:
        return len(STEPS)
    if state.mode in _EXECUTES:
        return 4
    done = (
        state.learned is not None and not state.recording,
        not state.standing.differs and bool(state.confirmed_sha256),
        state.mode in _ARMED,
        bool(state.plan_id),
        False,
    )
    return done.index(False)


def steps_html(state: ConsoleState) -> str:
    """Return the steps of the job: done, present, or locked with the reason."""
    now = step(state)
    parts = []
    for number, (step_words, name, why_locked) in enumerate(zip(STEPS, STEP_NAMES, WHY_LOCKED, strict=True)):
        kind = "done" if number < now else "now" if number == now else "locked"
        why = {"title": LOCKED.format(why_locked)} if kind == "locked" else {}
        mark = {"aria-current": "step"} if kind == "now" else {}
        words = f"{'✓' if kind == 'done' else number + 1} {step_words}"
        parts.append(element(name, words, f"fh-step fh-step-{kind}", tag="li", **why, **mark))
    return f'<ol class="fh-steps">{"".join(parts)}</ol>'


class ActionLine:
    """Buttons of which only those of the present state are drawn. Used by the page's thread.

    Args:
        gui: GUI of the server, within the folder of the action line.
        specs: All buttons, whichever may be offered.
        on_press: Called with the tab and the button, from the server's thread; must only enqueue.
    """

    def __init__(self, gui: viser.GuiApi, specs: tuple[ButtonSpec, ...], on_press: OnPress):
        self._steps = Html(gui)
        self._handles = {spec.label: (spec, buttons.add_button(gui, spec, on_press)) for spec in specs}
        for _, handle in self._handles.values():
            handle.visible = False
        self.hidden: tuple[ButtonSpec, ...] = ()
        """Buttons that the drawer must not offer: they are here, or not offered at all now."""

    def draw(self, state: ConsoleState, past: bool = False) -> None:
        """Show the actions of the present state; those that need its picture only while that is shown."""
        self._steps.show(steps_html(state))
        present = offered(state, past)
        self.hidden = present + buttons.NEED_THE_PRESENT if past else present
        places = {spec.label: place for place, spec in enumerate(present)}
        for label, (spec, handle) in self._handles.items():
            place = places.get(label)
            if handle.visible != (place is not None):
                handle.visible = place is not None
            if place is not None:
                buttons.show_state(handle, spec, state, primary=place == 0, order=100.0 + place)
