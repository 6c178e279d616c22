"""Picture of the robot's camera at the robot's half of the canvas, with its age and the expected tool drawn into it."""

from __future__ import annotations

import base64
import math
from collections.abc import Callable

import numpy as np
import viser
from numpy.typing import NDArray

from farhand.common.model.task_frame import TaskFrame
from farhand.common.wire.messages import CameraPicture
from farhand.common.wire.reason_words import sentence
from farhand.local_site.console import intents
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.exchange.report_age import LinkHealth
from farhand.local_site.view.panels.choices import HIDDEN, Act
from farhand.local_site.view.panels.html import Html, element
from farhand.local_site.view.panels.words.controls import CAMERA, CAMERA_ALT, Hint, Layer
from farhand.local_site.view.panels.words.status import camera_age_words, no_picture_words
from farhand.local_site.view.scene import palette
from farhand.local_site.view.scene.arm.in_picture import tool_outline
from farhand.local_site.view.scene.ghost import Ghost, reported_frame, reported_tip

Array = NDArray[np.float64]

_OLD_S, _OLD_INTERVALS = 0.7, 2.0
"""A picture is old from this time and so many intervals beyond the one-way delay on [s]."""
_AGE_PERIOD_S = 2.0
"""The told age is lowered so often [s]."""
_SHOWN: palette.Rgb = (75, 85, 99)


class CameraPanel:
    """Picture in picture, and the chip that hides it. While it is hidden, or no tab is open, no pictures are requested.

    Used by the page's thread alone, except for the chip's callback, which only enqueues.

    Args:
        gui: GUI of the server.
        submit: Hands an intent to the console.
        act: Has a tab's action done, from the server's thread; only enqueues.
    """

    def __init__(self, gui: viser.GuiApi, submit: Callable[[intents.Intent], None], act: Act):
        self._submit, self._shown, self._wanted = submit, True, False
        self._chip = gui.add_button(Layer.CAMERA, hint=Hint.CAMERA, color=_SHOWN, visible=False)
        self._picture, self._over = Html(gui), Html(gui)
        self._age = SteadyAge()

        @self._chip.on_click
        async def _(event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
            if event.client_id is not None:
                act(event.client_id, self._toggle)

    def draw(self, state: ConsoleState, ghost: Ghost | None, seen: bool, now_s: float) -> None:
        """Show the newest picture.

        Args:
            state: State of the console.
            ghost: Expected present pose of the robot's tool; None for none.
            seen: True if a tab is open and looks at the present.
            now_s: Present time on the console's clock [s].
        """
        self._request(self._shown and seen)
        camera = state.camera
        if self._chip.visible != camera.is_there:
            self._chip.visible = camera.is_there
        colour = _SHOWN if self._shown else HIDDEN
        if self._chip.color != colour:
            self._chip.color = colour
        if not (camera.wanted and camera.is_there and self._wanted):
            self._picture.show("")
            self._over.show("")
            return
        age_s = picture_age_s(state, now_s)
        picture = camera.picture if age_s is not None else None
        old = age_s is None or is_old(state, age_s)
        self._picture.show(_picture(picture, old) if picture is not None else "")
        self._over.show(_over(state, self._age.told(age_s, old, now_s), old, _tool(state, picture, ghost)))

    def _toggle(self) -> None:
        self._shown = not self._shown

    def _request(self, wanted: bool) -> None:
        if wanted != self._wanted:
            self._wanted = wanted
            self._submit(intents.WatchCamera(wanted))


class SteadyAge:
    """Age as it is told: the largest since it was last lowered, so that no figure flickers."""

    def __init__(self) -> None:
        self._age_s, self._told_s, self._old = 0.0, float("-inf"), False

    def told(self, age_s: float | None, old: bool, now_s: float) -> float | None:
        """Return the age to tell [s]; None without one.

        Args:
            age_s: Present age [s].
            old: True if that is too old; once it is not any more, the lower age is told at once.
            now_s: Present time [s].
        """
        if age_s is None:
            return None
        age_s = math.ceil(10.0 * age_s) / 10.0
        if age_s > self._age_s or now_s - self._told_s >= _AGE_PERIOD_S or old != self._old:
            self._age_s, self._told_s, self._old = age_s, now_s, old
        return self._age_s


def picture_age_s(state: ConsoleState, now_s: float) -> float | None:
    """Return the age of the newest picture, by the robot's own clock and the age of its newest report [s]; None without one."""
    picture, robot, age_s = state.camera.picture, state.robot, state.link.age_s
    if picture is None or robot is None or age_s is None or picture.stamp.boot != robot.stamp.boot:
        return None
    return max(0.0, age_s + now_s - state.now_s + 1e-9 * (robot.stamp.t_ns - picture.stamp.t_ns))


def is_old(state: ConsoleState, age_s: float) -> bool:
    """Decide whether a picture of that age is old: later ones should have come, or the link is not in order."""
    usual_s = 0.5 * (state.link.round_trip_s or 0.0) + _OLD_INTERVALS * state.camera.interval_s
    return state.link.health is not LinkHealth.OK or age_s > usual_s + _OLD_S


def _picture(picture: CameraPicture, old: bool) -> str:
    data = base64.b64encode(picture.jpeg).decode("ascii")
    size = f'width="{picture.width_px}" height="{picture.height_px}"'
    image = f'<img alt="{CAMERA_ALT}" decoding="sync" {size} src="data:image/jpeg;base64,{data}">'
    return f'<div class="fh-camera{" fh-camera-old" if old else ""}">{image}</div>'


def _over(state: ConsoleState, age_s: float | None, old: bool, tool: str) -> str:
    """Return what lies over the picture and below it, which changes more often: the tool, the age, the reason for no picture."""
    why, picture = sentence(state.camera.why), state.camera.picture
    reason = no_picture_words(why, age_s is None)
    drawn, words = "", ""
    if picture is not None and age_s is not None:
        drawn = f'<svg viewBox="0 0 {picture.width_px} {picture.height_px}">{tool}</svg>'
        age = element("camera-age", camera_age_words(age_s, old), "fh-old" if old else "")
        words = f'<div class="fh-camera-words">{CAMERA} {age}</div>'
    return f'<div class="fh-camera">{drawn}{element("camera-why", reason, "fh-camera-why")}{words}</div>'


def _tool(state: ConsoleState, picture: CameraPicture | None, ghost: Ghost | None) -> str:
    """Return the expected tool as SVG: as predicted, else, while the hand drives the robot, as it was last reported."""
    robot, drawing = state.robot, state.robot_scene
    if picture is None or picture.view is None or robot is None or drawing is None:
        return ""
    if ghost is not None:
        in_frame, colour = ghost.point, palette.PREDICTED
    elif state.coupled:
        in_frame, colour = reported_tip(robot), palette.REMOTE
    else:
        return ""
    tip = TaskFrame.at(reported_frame(robot)).to_world(in_frame)
    outline = tool_outline(picture.view, drawing, tip)
    if outline is None:
        return ""
    hull, axis = (" ".join(f"{x:.1f},{y:.1f}" for x, y in points) for points in outline)
    stroke = f'stroke="{palette.css(colour)}" vector-effect="non-scaling-stroke"'
    return f'<polygon data-tp="camera-tool" points="{hull}" {stroke}/><polyline points="{axis}" {stroke}/>'
