"""Hand without a mouse: keys step it or move it on, a gamepad moves it while its dead-man button is held.

It hears the lines of `hand_keys.py`. If they stop, the hand lets go.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from farhand.common.model.manifold import POSE
from farhand.local_site.console import intents
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.view.scene.ghost import reported_frame
from farhand.local_site.view.scene.hand_keys import SILENT_HERE_S, SILENT_S, HandLine
from farhand.local_site.workcell.hand_motion import Nudge, hand_axes

Array = NDArray[np.float64]

_SPEED_M_S, _SPEED_RAD_S = 0.08, 0.35
_STEP_M, _STEP_RAD = 1e-3, float(np.radians(0.2))
"""A counted step; a press of a key is five of them."""
_MOST_STEPS = 100
_AHEAD_M, _AHEAD_RAD = 0.025, 0.15
"""Largest lead of the hand over the operator's own arm, which may be held up by a contact [m, rad]."""
_LONGEST_S = 0.1


class Jog:
    """Motion of the hand by keys and gamepad. Used by the page's thread.

    Args:
        lead: Moves the hand: given "update" or "end", and its pose relative to the arm's base, shape (7,).
        submit: Hands an intent to the console.
        turns: Decides whether the plug is turned instead of moved.
    """

    def __init__(
        self, lead: Callable[[str, Array], None], submit: Callable[[intents.Intent], None], turns: Callable[[], bool]
    ):  # fmt: skip
        self._lead, self._submit, self.turns = lead, submit, turns
        self._line: HandLine | None = None
        self._heard_s, self._stepped_s = float("-inf"), 0.0
        self._steps = np.zeros(3)
        self._pose: Array | None = None
        self._drives = self._spent = False

    def hear(self, text: str, now_s: float) -> None:
        """Take a line of the active tab; anything else is ignored.

        Args:
            text: The line.
            now_s: Now [s].
        """
        line = HandLine.parse(text)
        if line is None:
            return
        known = self._line.steps if self._line is not None and self._line.burst == line.burst else np.zeros(3)
        self._steps = np.clip(self._steps + line.steps - known, -_MOST_STEPS, _MOST_STEPS)
        self._line, self._heard_s = line, now_s

    def step(self, state: ConsoleState, now_s: float) -> None:
        """Move the hand on; called thirty times a second.

        Args:
            state: State of the console.
            now_s: Now [s].
        """
        arm, line = state.own_arm, self._line
        duration_s, self._stepped_s = min(now_s - self._stepped_s, _LONGEST_S), now_s
        if arm is None or line is None or not (line.held or self._pose is not None or self._steps.any()):
            self._spent = False
            return
        axes = hand_axes(reported_frame(state.robot) if state.coupled and state.robot else arm.receptacle)
        self._take_steps(state, axes)
        if not line.held or now_s - self._heard_s > (SILENT_S if state.coupled else SILENT_HERE_S):
            self.let_go()
            self._spent = False
        elif self._pose is not None and state.coupled != self._drives:
            self.let_go()
            self._spent = True  # what moved one arm must never move the other: first it is let go
        elif not self._spent:
            start = arm.tip if self._pose is None else self._pose
            self._drives = state.coupled
            pose = self._moved(start, axes @ line.speed, axes, line.speed, duration_s)
            self._pose = pose if state.coupled else _near(arm.tip, pose)
            self._lead("update", self._pose)

    def let_go(self) -> None:
        """Let the hand go, at once."""
        if self._pose is not None:
            pose, self._pose = self._pose, None
            self._lead("end", pose)

    def _take_steps(self, state: ConsoleState, axes: Array) -> None:
        steps, self._steps = self._steps, np.zeros(3)
        if not steps.any() or state.coupled or not state.recording:
            return
        if self.turns():
            nudge = Nudge((0.0, 0.0, 0.0), _triple(_STEP_RAD * _turning(axes) @ steps))
        else:
            nudge = Nudge(_triple(_STEP_M * axes @ steps))
        self._submit(intents.StepArm(nudge))

    def _moved(self, pose: Array, move: Array, axes: Array, speed: Array, duration_s: float) -> Array:
        if not self.turns():
            return np.concatenate([pose[:3] + _SPEED_M_S * duration_s * move, pose[3:]])
        turn = Rotation.from_rotvec(_SPEED_RAD_S * duration_s * _turning(axes) @ speed)
        turned = turn * Rotation.from_quat(pose[3:], scalar_first=True)
        return np.concatenate([pose[:3], turned.as_quat(scalar_first=True)])


def _turning(axes: Array) -> Array:
    """Return the axes about which the plug's front turns to the right and up, and the plug about itself. Shape (3, 3)."""
    right, up, into = axes.T
    return np.column_stack([-up, right, into])


def _near(tip: Array, pose: Array) -> Array:
    """Return a pose that is not too far ahead of the arm. Shape (7,)."""
    way = POSE.log(tip, pose)
    too_far = max(np.linalg.norm(way[:3]) / _AHEAD_M, np.linalg.norm(way[3:]) / _AHEAD_RAD)
    return pose if too_far <= 1.0 else POSE.exp(tip, way / too_far)


def _triple(vector: Array) -> tuple[float, float, float]:
    x, y, z = vector.tolist()
    return x, y, z
