"""Hand of the operator while an arm is taught: gauge of the plug's depth, distance beside the axis and tilt; its keys."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
import viser
from numpy.typing import NDArray

from farhand.common.clock import elapsed_s
from farhand.common.task import ArmTask
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.view.panels.choices import Act
from farhand.local_site.view.panels.html import Html, element
from farhand.local_site.view.panels.words.controls import Field, Folder
from farhand.local_site.view.panels.words.tasks import askew_words, beside_words, keys_words, to_go_words
from farhand.local_site.view.scene.arm.jog import Jog
from farhand.local_site.view.scene.board.board_jog import BoardJog
from farhand.local_site.workcell.arm_view import ArmView
from farhand.local_site.workcell.hand_motion import hand_axes

_FURTHEST_M, _CHAMFER_M, _MOST_ASKEW_RAD = 0.25, 0.015, math.radians(3.0)
"""Limit of the scales; beside the axis by more than the chamfer, or more askew, the plug does not go in [m, rad]."""
_MIDDLE_PX, _RADIUS_PX = 46.0, 33.0
_TOP_PX, _HEIGHT_PX, _BAR_PX = 13.0, 66.0, 122.0
_KEYS = (
    ("L", 86.0, 50.0),
    ("J", 6.0, 50.0),
    ("U", 46.0, 10.0),
    ("O", 46.0, 92.0),
    ("I", 122.0, 10.0),
    ("K", 122.0, 92.0),
)
"""Key of each direction, and its place in the drawing [px]."""  # fmt: skip


class HandPanel:
    """Gauge over the canvas, and the hidden field through which keys and gamepad reach the hand. Used by the page's thread.

    Args:
        gui: GUI of the server.
        act: Has a tab's action done, from the server's thread; only enqueues.
        jog: Moves the hand.
    """

    def __init__(self, gui: viser.GuiApi, act: Act, jog: Jog | BoardJog):
        self._jog, self._gauge = jog, Html(gui)
        with gui.add_folder(Folder.HAND):
            gui.add_html('<i class="fh-here fh-here-hand"></i>')
            field = gui.add_text(Field.HAND, "")

        @field.on_update
        async def _(event: viser.GuiEvent[viser.GuiTextHandle]) -> None:
            if event.client_id is not None:
                act(event.client_id, partial(jog.hear, event.target.value, elapsed_s()))

    def move(self, state: ConsoleState, now_s: float) -> None:
        """Move the hand on by keys and gamepad, see `Jog.step`."""
        self._jog.step(state, now_s)

    def draw(self, state: ConsoleState) -> None:
        """Show the place of the plug while a demonstration is recorded."""
        self._gauge.show(gauge_html(state, self._jog.turns()))


def gauge_html(state: ConsoleState, turns: bool) -> str:
    """Return the gauge; empty while nothing is taught with an arm.

    Args:
        state: State of the console.
        turns: True if the keys turn the plug, and do not move it.
    """
    arm = state.own_arm
    if arm is None or not state.recording or not isinstance(state.task, ArmTask):
        return ""
    beside_m = arm.lateral_m
    rows = (
        ("depth", to_go_words(arm), "fh-reached" if state.at_goal else ""),
        ("beside", beside_words(beside_m), "fh-off" if beside_m > _CHAMFER_M else ""),
        ("tilt", askew_words(arm.tilt_rad), "fh-off" if arm.tilt_rad > _MOST_ASKEW_RAD else ""),
    )
    told = "".join(element(f"gauge-{name}", words, kind, tag="div") for name, words, kind in rows)
    return (
        f'<div class="fh-gauge" data-tp="gauge">{_drawing(arm)}<div>{told}'
        f'<p>{element("gauge-keys", keys_words(turns))}<span class="fh-pad"></span></p></div></div>'
    )  # fmt: skip


def beside_axis(arm: ArmView) -> NDArray[np.float64]:
    """Return the distances of the plug to the right of the bore's axis and above it, seen from behind. Shape (2,) [m]."""
    return hand_axes(arm.receptacle)[:, :2].T @ (arm.tip[:3] - arm.receptacle[:3])


def _drawing(arm: ArmView) -> str:
    """Return a dial that shows the plug beside the axis, and a bar that shows its depth, each with its keys."""
    right_px, up_px = (_scaled_px(float(way_m)) for way_m in beside_axis(arm))
    middle, bar = _MIDDLE_PX, _BAR_PX
    mouth_px, plug_px = _bar_px(0.0, arm), _bar_px(arm.depth_m, arm)
    keys = "".join(f'<text x="{x:g}" y="{y:g}">{key}</text>' for key, x, y in _KEYS)
    return (
        f'<svg viewBox="0 0 140 96" aria-hidden="true"><circle class="fh-dial" cx="{middle:g}" cy="{middle:g}" r="{_RADIUS_PX:g}"/>'
        f'<circle class="fh-mouth" cx="{middle:g}" cy="{middle:g}" r="{_scaled_px(_CHAMFER_M):.1f}"/>'
        f'<path class="fh-mouth" d="M{middle - 4:g} {middle:g}h8M{middle:g} {middle - 4:g}v8"/>'
        f'<circle class="fh-plug" cx="{middle + right_px:.1f}" cy="{middle - up_px:.1f}" r="4.5"/>'
        f'<rect class="fh-dial" x="{bar - 7:g}" y="{_TOP_PX:g}" width="14" height="{_HEIGHT_PX:g}"/>'
        f'<rect class="fh-bore" x="{bar - 7:g}" y="{_TOP_PX:g}" width="14" height="{mouth_px - _TOP_PX:.1f}"/>'
        f'<path class="fh-plug" d="M{bar - 9:g} {plug_px:.1f}h18v3h-18z"/>{keys}</svg>'
    )


def _scaled_px(way_m: float) -> float:
    """Return a distance on the dial, whose scale is finer near the axis."""
    return math.copysign(_RADIUS_PX * math.sqrt(min(abs(way_m) / _FURTHEST_M, 1.0)), way_m)


def _bar_px(depth_m: float, arm: ArmView) -> float:
    """Return a depth on the bar: the bottom of the bore is its upper end, its lower end is far before the mouth."""
    to_go_m = min(max(arm.bore_m - depth_m, 0.0), arm.bore_m + _FURTHEST_M)
    return _TOP_PX + _HEIGHT_PX * math.sqrt(to_go_m / (arm.bore_m + _FURTHEST_M))
