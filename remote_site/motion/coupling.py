"""Direct teleoperation: the robot follows the difference of the operator's hand from its anchor.

Of a robot whose points are poses the hand's rotation counts too: by how far the hand was turned, about the axes
of the world, by so much the robot's reference is turned about the same axes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from farhand.common.model.manifold import POSE
from farhand.common.model.task_frame import TaskFrame
from farhand.common.wire.messages import OperatorInput
from farhand.common.wire.reasons import Code, Reason, because

Array = NDArray[np.float64]

INPUT_SILENCE_S = 0.5
"""Without input for this long the robot stops where it is; the next input re-anchors."""
INPUT_ABANDONED_S = 10.0
"""Without input for this long the coupling ends; at first the operator must hear of it before."""
_RAMP_S = 1.0
_RAMP_SPEED = 0.2


class Coupling:
    """One coupling: made by Couple, ended with DIRECT, never used again.

    Args:
        coupling_id: What each input must carry.
        lease_id: Whose it is: it ends with that lease.
        now_s: When it was made, on the robot's clock [s].
        round_trip_s: How long it takes at least until the first input can be there [s].
    """

    def __init__(self, coupling_id: int, lease_id: str, now_s: float, round_trip_s: float = 0.0):
        self.coupling_id, self.lease_id = coupling_id, lease_id
        self._last_input_s = now_s + round_trip_s
        self._driven_from_s: float | None = None
        self.newest_seq = -1
        """Of the inputs that counted."""
        self._hand: Array | None = None
        self._anchor: tuple[Array, Array] | None = None  # of the hand, and of the reference
        self._reference: Array | None = None
        self.released = False

    def feed(self, message: OperatorInput, robot: Array, now_s: float) -> None:
        """Take one input of the operator; late, repeated and misshapen ones are ignored.

        Args:
            message: The input, already checked for age, lease and coupling.
            robot: Where the robot, or its setpoint, is: the anchor of a new beginning. Shape (C,).
            now_s: Now [s].
        """
        hand = _hand_of(message, robot.size)
        if message.seq <= self.newest_seq or hand is None:
            return
        self.newest_seq = message.seq
        if self._anchor is None or self.waiting(now_s):
            # Anchor: from here on the robot follows the hand's difference, so nothing jumps.
            self._anchor = (hand, self._reference if self._reference is not None else robot.copy())
        if self._driven_from_s is None:
            self._driven_from_s = now_s
        self._last_input_s = now_s
        self._hand = hand
        self._reference = _moved_alike(*self._anchor, hand)
        self.released = self.released or message.released

    def waiting(self, now_s: float) -> bool:
        """Whether the robot waits where it is, for want of input."""
        return self._anchor is None or now_s - self._last_input_s > INPUT_SILENCE_S

    def stop_here(self, robot: Array) -> None:
        """While waiting: what the operator reaches next continues from here, without a jump. Shape (C,)."""
        self._reference = robot.copy()

    def confine(self, reference: Array) -> None:
        """The robot could not be led further than here: the hand goes on from here, without a detour. Shape (C,)."""
        if self._hand is not None:
            self._anchor, self._reference = (self._hand, reference), reference

    def end_reason(self, now_s: float) -> Reason | None:
        """Return why the coupling ends by what the hand did or did not do; None while it may go on."""
        if self.released:
            return because(Code.DRAG_ENDED)
        if now_s - self._last_input_s > INPUT_ABANDONED_S:
            return because(Code.NO_INPUT, limit_s=INPUT_ABANDONED_S)
        return None

    def reference(self, now_s: float) -> Array | None:
        """Where the robot should be. Shape (C,). None while it waits for input."""
        return None if self.waiting(now_s) else self._reference

    def speed_scale(self, now_s: float) -> float:
        """Part of the full speed that is allowed now: slow in the first second of driving."""
        driven_from_s = now_s if self._driven_from_s is None else self._driven_from_s
        return _RAMP_SPEED if now_s - driven_from_s < _RAMP_S else 1.0


def _hand_of(message: OperatorInput, n_coordinates: int) -> Array | None:
    """The hand's point, of the robot's kind; None when it is of another."""
    oriented = n_coordinates == POSE.n_coordinates
    position = np.array(message.position_m)
    if position.size != (POSE.n_dims if oriented else n_coordinates):
        return None
    if not oriented:
        return position
    if len(message.rotation_rad) not in (0, POSE.n_dims):
        return None
    turn = message.rotation_rad or (0.0,) * POSE.n_dims
    return POSE.exp((*position, 1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, *turn))


def _moved_alike(hand_before: Array, reference: Array, hand: Array) -> Array:
    """The reference, moved and turned as the hand was. Shapes (C,)."""
    if hand.size != POSE.n_coordinates:
        return reference + (hand - hand_before)
    before, now = TaskFrame.at(hand_before), TaskFrame.at(hand)
    moved = TaskFrame(now.A @ before.A.T, np.zeros(POSE.n_dims)).to_world(reference)
    moved[: POSE.n_dims] = reference[: POSE.n_dims] + (now.b - before.b)
    return moved
