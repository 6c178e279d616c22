"""Operator's buttons: each submits an intent, and may be pressed while the console would do it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import viser

from farhand.common.control_mode import Action, ControlMode
from farhand.common.wire.messages import Wish
from farhand.local_site.console import intents
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.console.permission import refusal_of

_PENDING_ICON = viser.Icon.HOURGLASS
OnPress = Callable[[int, "ButtonSpec"], None]
Colour = Literal["blue", "gray", "green", "orange", "red", "yellow"]


@dataclass(frozen=True)
class ButtonSpec:
    """Specification of one button; it may be pressed while the console would do its intent.

    Args:
        label: Text on the button; a verb.
        make: Makes the intent, given the mode that the page shows.
        pending: Decides whether its action is pending.
        colour: Colour of the button.
        offered: Decides whether the button has a meaning now.
    """

    label: str
    make: Callable[[ControlMode | None], intents.Intent]
    pending: Callable[[ConsoleState], bool] = lambda state: False
    colour: Colour = "blue"
    offered: Callable[[ConsoleState], bool] = lambda state: True

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


STOP = _command(Action.STOP, "STOP", "red")
TEACH = (
    _local("Record", intents.RecordDemonstration(), lambda state: Action.RECORD in state.pending),
    _local("End", intents.EndDemonstration()),
    replace(
        _local("Keep anyway", intents.EndDemonstration(anyway=True), colour="gray"),
        offered=lambda state: bool(state.miss),
    ),
    _local("Undo", intents.Undo(), colour="gray"),
    _local("Load samples", intents.LoadSamples(), colour="gray"),
    _local("Send model", intents.SendModel(), lambda state: state.sending_model),
)
TEACH_ARM = (
    *TEACH,
    _local("Align", intents.Align(), colour="gray"),
    _local("New place", intents.ResetArm(), colour="gray"),
)
SEND_LIBRARY = _local("Send library", intents.SendLibrary(), lambda state: state.sending_library)
LIBRARY = (_local("Start anew", intents.StartAnew()), _local("Recover", intents.Recover()))
ROBOT = (
    _command(Action.ARM, "Arm"),
    _command(Action.DISARM, "Disarm", "gray"),
    _command(Action.COUPLE, "Couple"),
    _command(Action.CLUTCH, "Clutch"),
    _command(Action.PREVIEW, "Preview", "gray"),
    _command(Action.EXECUTE, "Execute", "green"),
    _command(Action.ABORT, "Abort", "orange"),
    _command(Action.PAUSE, "Pause", "orange"),
    _command(Action.RESUME, "Resume", "green"),
    _command(Action.RETRACT, "Retract", "gray"),
    _command(Action.GO_TO_READY, "Go to ready", "gray"),
    _command(Action.RESET, "Reset", "gray"),
)
CONTROL = (
    _wish(Wish.ASK, "Ask for control"),
    _wish(Wish.GIVE, "Hand over", "yellow"),
    _wish(Wish.WATCH, "Only watch"),
)


class Buttons:
    """Group of buttons on the page.

    Args:
        gui: GUI of the server.
        specs: Specifications.
        on_press: Called with the tab and the button, from the server's thread; must only enqueue.
    """

    def __init__(self, gui: viser.GuiApi, specs: tuple[ButtonSpec, ...], on_press: OnPress):
        self._handles = [(spec, self._add(gui, spec, on_press)) for spec in specs]

    @property
    def handles(self) -> list[viser.GuiButtonHandle]:
        """Buttons in the order of their specifications."""
        return [handle for _, handle in self._handles]

    def draw(self, state: ConsoleState) -> None:
        """Enable what may be pressed, and mark what is pending."""
        for spec, handle in self._handles:
            disabled, pending = not spec.enabled(state), spec.pending(state)
            if handle.disabled != disabled:
                handle.disabled = disabled
            icon = _PENDING_ICON if pending else None
            if handle.icon != icon:
                handle.icon, handle.color = icon, "yellow" if pending else spec.colour

    @staticmethod
    def _add(gui: viser.GuiApi, spec: ButtonSpec, on_press: OnPress) -> viser.GuiButtonHandle:
        handle = gui.add_button(spec.label, color=spec.colour)

        async def pressed(event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
            if event.client_id is not None:
                on_press(event.client_id, spec)

        handle.on_click(pressed)
        return handle
