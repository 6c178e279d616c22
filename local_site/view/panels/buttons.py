"""Operator's buttons: each submits an intent.

Enabled only when the table of modes and the console allow it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import viser

from farhand.common.control_mode import Action, ControlMode
from farhand.common.wire.messages import Wish
from farhand.local_site.console import intents
from farhand.local_site.console.command_check import command_refusal
from farhand.local_site.console.console_state import ConsoleState

_PENDING_ICON = viser.Icon.HOURGLASS
OnPress = Callable[[int, "ButtonSpec"], None]
Colour = Literal["blue", "gray", "green", "orange", "red", "yellow"]


@dataclass(frozen=True)
class ButtonSpec:
    """Specification of one button.

    Args:
        label: Text on the button; a verb.
        make: Makes the intent, given the mode that the page shows.
        enabled: Decides whether the button may be pressed.
        pending: Decides whether its action is pending.
    """

    label: str
    make: Callable[[ControlMode | None], intents.Intent]
    enabled: Callable[[ConsoleState], bool]
    pending: Callable[[ConsoleState], bool] = lambda picture: False
    colour: Colour = "blue"


def _command(action: Action, label: str, colour: Colour = "blue") -> ButtonSpec:
    return ButtonSpec(
        label,
        lambda shown: intents.CommandRobot(action, shown),
        lambda picture: command_refusal(action, picture) is None,
        lambda picture: action in picture.pending,
        colour,
    )


def _wish(
    wish: Wish, label: str, enabled: Callable[[ConsoleState], bool], colour: Colour = "gray"
) -> ButtonSpec:
    """Return a button for the control of the robot, which stays marked until the robot has answered."""
    return ButtonSpec(
        label,
        lambda _shown: intents.WishControl(wish),
        lambda picture: picture.robot is not None and enabled(picture),
        lambda picture: picture.wish is wish and wish in (Wish.ASK, Wish.GIVE),
        colour,
    )


def _can_send(picture: ConsoleState) -> bool:
    return picture.standing.differs and not picture.sending_model


def _can_send_library(picture: ConsoleState) -> bool:
    return any(task.differs for task in picture.tasks) and not picture.sending_library


def _can_record(picture: ConsoleState) -> bool:
    """Decide whether the workcell may record; while coupled, the robot records instead."""
    if picture.coupled:
        return command_refusal(Action.RECORD, picture) is None
    return not picture.recording


STOP = _command(Action.STOP, "STOP", "red")
TEACH = (
    ButtonSpec(
        "Record", lambda _: intents.RecordDemonstration(), _can_record, lambda p: Action.RECORD in p.pending
    ),
    ButtonSpec("End", lambda _: intents.EndDemonstration(), lambda p: p.recording or p.robot_records),
    ButtonSpec(
        "Keep anyway", lambda _: intents.EndDemonstration(anyway=True), lambda p: bool(p.miss), colour="gray"
    ),
    ButtonSpec("Undo", lambda _: intents.Undo(), lambda p: p.can_undo or p.robot_records, colour="gray"),
    ButtonSpec("Load samples", lambda _: intents.LoadSamples(), lambda p: not p.recording, colour="gray"),
    ButtonSpec("Send model", lambda _: intents.SendModel(), _can_send, lambda p: p.sending_model),
)
TEACH_ARM = (
    *TEACH,
    ButtonSpec("Align", lambda _: intents.Align(), lambda p: not p.coupled, colour="gray"),
    ButtonSpec("New place", lambda _: intents.ResetArm(), lambda p: not p.recording, colour="gray"),
)
SEND_LIBRARY = ButtonSpec(
    "Send library", lambda _: intents.SendLibrary(), _can_send_library, lambda p: p.sending_library
)
LIBRARY = (
    ButtonSpec("Start anew", lambda _: intents.StartAnew(), lambda p: p.can_undo and not p.recording),
    ButtonSpec("Recover", lambda _: intents.Recover(), lambda p: p.can_recover),
)
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
    _wish(Wish.ASK, "Ask for control", lambda p: not p.in_control and p.wish is not Wish.ASK),
    _wish(Wish.GIVE, "Hand over", lambda p: p.in_control and bool(p.asked_by), "yellow"),
    _wish(Wish.WATCH, "Only watch", lambda p: p.in_control),
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

    def draw(self, picture: ConsoleState) -> None:
        """Enable the buttons that may be pressed, and mark the pending ones."""
        for spec, handle in self._handles:
            disabled, pending = not spec.enabled(picture), spec.pending(picture)
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
