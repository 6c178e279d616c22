"""Operator's buttons: each submits an intent, and may be pressed while the console would do it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import viser

from farhand.common.mode_table import Action, ControlMode
from farhand.common.wire.messages import Wish
from farhand.local_site.console import intents
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.console.intent_permission import refusal_of
from farhand.local_site.exchange.report_age import LinkHealth
from farhand.local_site.view.panels.words.controls import Label

_PENDING_ICON = viser.Icon.HOURGLASS

OnPress = Callable[[int, "ButtonSpec"], None]
Colour = Literal["blue", "gray", "green", "orange", "red", "yellow"]


@dataclass(frozen=True)
class ButtonSpec:
    """Specification of one button; it may be pressed while the console would do its intent.

    Args:
        label: Text on the button.
        make: Makes the intent, given the mode that the page shows.
        pending: Decides whether its action is pending.
        colour: Colour of the button.
        offered: Decides whether the button has a meaning now.
        ready: Decides whether it is the moment to press the button, which is green then.
        waits: Decides whether it is too early to advise the button, which is not filled then.
    """

    label: str
    make: Callable[[ControlMode | None], intents.Intent]
    pending: Callable[[ConsoleState], bool] = lambda state: False
    colour: Colour = "blue"
    offered: Callable[[ConsoleState], bool] = lambda state: True
    ready: Callable[[ConsoleState], bool] = lambda state: False
    waits: Callable[[ConsoleState], bool] = lambda state: False

    def enabled(self, state: ConsoleState) -> bool:
        """Decide whether the button may be pressed now."""
        return self.offered(state) and refusal_of(self.make(None), state) is None


def _command(action: Action, label: str, colour: Colour = "blue") -> ButtonSpec:
    return ButtonSpec(
        label,
        lambda shown: intents.CommandRobot(action, shown),
        lambda state: action in state.pending,
        colour,
    )


def _wish(wish: Wish, label: str, colour: Colour = "gray") -> ButtonSpec:
    """Return a button about who is in control; it stays marked until the robot has answered."""
    return ButtonSpec(
        label,
        lambda _: intents.WishControl(wish),
        lambda state: state.wish is wish and wish in (Wish.ASK, Wish.GIVE),
        colour,
    )


def _local(
    label: str,
    intent: intents.Intent,
    pending: Callable[[ConsoleState], bool] = lambda state: False,
    colour: Colour = "blue",
) -> ButtonSpec:
    """Return a button about this site's own demonstrations, models and arm."""
    return ButtonSpec(label, lambda _: intent, pending, colour)


STOP = _command(Action.STOP, Label.STOP, "red")
RECORD = _local(Label.RECORD, intents.RecordDemonstration(), lambda state: Action.RECORD in state.pending)
END = replace(
    _local(Label.END, intents.EndDemonstration()),
    ready=lambda state: state.at_goal,
    waits=lambda state: state.own_arm is not None and state.recording and not state.at_goal,
)
KEEP = replace(
    _local(Label.KEEP, intents.EndDemonstration(anyway=True), colour="gray"),
    offered=lambda state: bool(state.miss),
)
UNDO = _local(Label.UNDO, intents.Undo(), colour="gray")
LOAD_SAMPLES = _local(Label.LOAD_SAMPLES, intents.LoadSamples(), colour="gray")
SEND_MODEL = _local(Label.SEND_MODEL, intents.SendModel(), lambda state: state.sending_model)
ALIGN = replace(
    _local(Label.ALIGN, intents.Align(), colour="gray"), offered=lambda state: state.can_move_place
)
CENTRE = replace(
    _local(Label.CENTRE, intents.Centre(), colour="gray"), offered=lambda state: state.can_move_place
)
NEW_PLACE = replace(
    _local(Label.NEW_PLACE, intents.ResetArm(), colour="gray"), offered=lambda state: state.can_move_place
)
SEND_LIBRARY = _local(Label.SEND_LIBRARY, intents.SendLibrary(), lambda state: state.sending_library)
START_ANEW = _local(Label.START_ANEW, intents.StartAnew(), colour="gray")
RECOVER = _local(Label.RECOVER, intents.Recover(), colour="gray")
ARM, DISARM = _command(Action.ARM, Label.ARM), _command(Action.DISARM, Label.DISARM, "gray")
COUPLE, CLUTCH = _command(Action.COUPLE, Label.COUPLE), _command(Action.CLUTCH, Label.CLUTCH)
PREVIEW, EXECUTE = _command(Action.PREVIEW, Label.PREVIEW), _command(Action.EXECUTE, Label.EXECUTE, "green")
PAUSE, RESUME = _command(Action.PAUSE, Label.PAUSE, "orange"), _command(Action.RESUME, Label.RESUME, "green")
ABORT, RESET = _command(Action.ABORT, Label.ABORT, "orange"), _command(Action.RESET, Label.RESET)
RETRACT, GO_TO_READY = (
    _command(Action.RETRACT, Label.RETRACT),
    _command(Action.GO_TO_READY, Label.GO_TO_READY),
)
ASK, HAND_OVER = _wish(Wish.ASK, Label.ASK), _wish(Wish.GIVE, Label.HAND_OVER, "yellow")
ONLY_WATCH = _wish(Wish.WATCH, Label.ONLY_WATCH)

TEACH = (RECORD, END, KEEP, UNDO, LOAD_SAMPLES, SEND_MODEL, ALIGN, CENTRE, NEW_PLACE)
LIBRARY = (START_ANEW, RECOVER)
ROBOT = (
    ARM, DISARM, COUPLE, CLUTCH, PREVIEW, EXECUTE, ABORT, PAUSE, RESUME, RETRACT, GO_TO_READY, RESET,
)  # fmt: skip
CONTROL = (ASK, HAND_OVER, ONLY_WATCH)
NEED_THE_PRESENT = (ARM, COUPLE, PREVIEW, EXECUTE, RESUME, RETRACT, GO_TO_READY, RESET)
"""Buttons that set the robot in motion, or lead to that: enabled only in tabs that show the robot as it is now."""
EVERY = (*TEACH, SEND_LIBRARY, *LIBRARY, *ROBOT, *CONTROL)


class Buttons:
    """Group of buttons on the page.

    Args:
        gui: GUI of the server.
        specs: Specifications.
        on_press: Called with the tab and the button, from the server's thread; must only enqueue.
    """

    def __init__(self, gui: viser.GuiApi, specs: tuple[ButtonSpec, ...], on_press: OnPress):
        self._handles = [(spec, add_button(gui, spec, on_press)) for spec in specs]

    @property
    def handles(self) -> list[viser.GuiButtonHandle]:
        """Buttons in the order of their specifications."""
        return [handle for _, handle in self._handles]

    def draw(self, state: ConsoleState, elsewhere: tuple[ButtonSpec, ...] = ()) -> None:
        """Draw what may be pressed and is not drawn elsewhere, and mark what is pending."""
        for spec, handle in self._handles:
            lost = spec in ROBOT and state.link.health is LinkHealth.LOST
            visible = spec not in elsewhere and not lost and (spec.enabled(state) or spec.pending(state))
            if handle.visible != visible:
                handle.visible = visible
            show_state(handle, spec, state, primary=spec is STOP)


def add_button(gui: viser.GuiApi, spec: ButtonSpec, on_press: OnPress) -> viser.GuiButtonHandle:
    """Add a button whose press is only enqueued."""
    handle = gui.add_button(spec.label, color=spec.colour)

    async def pressed(event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
        if event.client_id is not None:
            on_press(event.client_id, spec)

    handle.on_click(pressed)
    return handle


def add_tab_button(
    gui: viser.GuiApi, label: str, do: Callable[[int], None], enqueue: Callable[[Callable[[], None]], None]
) -> viser.GuiButtonHandle:
    """Add a button about the tab alone that presses it.

    Args:
        gui: GUI of the server.
        label: Text on the button.
        do: Called with the tab, on the page's thread.
        enqueue: Has a function called on the page's thread.
    """
    handle = gui.add_button(label, color="gray")

    async def pressed(event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
        if (tab := event.client_id) is not None:
            enqueue(lambda: do(tab))

    handle.on_click(pressed)
    return handle


def show_state(
    handle: viser.GuiButtonHandle,
    spec: ButtonSpec,
    state: ConsoleState,
    primary: bool,
    order: float | None = None,
) -> None:
    """Enable a button that may be pressed, mark a pending one, and fill the primary one."""
    pending = spec.pending(state)
    wanted: dict[str, object] = {
        "disabled": not spec.enabled(state),
        "icon": _PENDING_ICON if pending else None,
        "color": _colour(spec, state, pending, primary),
        "order": handle.order if order is None else order,
    }
    for name, value in wanted.items():
        if getattr(handle, name) != value:
            setattr(handle, name, value)


def _colour(spec: ButtonSpec, state: ConsoleState, pending: bool, primary: bool) -> Colour:
    """Return the colour of a button: yellow while pending, green when it is time for it, filled if it is the first one."""
    if pending:
        return "yellow"
    if spec.ready(state):
        return "green"
    if not primary or spec.waits(state):
        return "gray"
    return "blue" if spec.colour == "gray" else spec.colour
