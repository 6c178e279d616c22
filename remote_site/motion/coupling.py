"""Direct teleoperation: the robot follows the difference of the operator's hand from its anchor.

If the robot's points are poses, the hand's rotation is followed as well: the robot's reference is rotated about the
same axes of the world, and by the same angle, as the hand.
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
"""Without input for this long the coupling ends; the first input may take a round trip longer."""
_RAMP_S = 1.0
_RAMP_SPEED = 0.2


class Coupling:
    """One coupling: made by Couple, ended with DIRECT, never used again.

    Args:
        coupling_id: Id that each input must carry.
        lease_id: Lease of its operator: it ends with that lease.
        now_s: Time of its making, on the robot's clock [s].
        round_trip_s: Least time until the first input can arrive [s].
    """

    def __init__(self, coupling_id: int, lease_id: str, now_s: float, round_trip_s: float = 0.0):
        self.coupling_id, self.lease_id = coupling_id, lease_id
        self._last_input_s = now_s + round_trip_s
        self._driven_from_s: float | None = None
        self.newest_seq = -1
        """Newest sequence number of an accepted input."""
        self._hand: Array | None = None
        self._anchor: tuple[Array, Array] | None = None  # anchors of the hand and of the reference
        self._reference: Array | None = None
        self.released = False

    def feed(self, message: OperatorInput, robot: Array, now_s: float) -> None:
        """Take one input of the operator; ignore late, repeated and malformed ones.

        Args:
            message: The input, already checked for age, lease and coupling.
            robot: Point of the robot, or of its setpoint, which becomes the anchor. Shape (C,).
            now_s: Present time on the robot's clock [s].
        """
        hand = _hand_of(message, robot.size)
        if message.seq <= self.newest_seq or hand is None:
            return
        self.newest_seq = message.seq
        if self._anchor is None or self.waiting(now_s):
            # Anchor: from here on the robot follows the hand's difference, so the reference does not jump.
            self._anchor = (hand, self._reference if self._reference is not None else robot.copy())
        if self._driven_from_s is None:
            self._driven_from_s = now_s
        self._last_input_s = now_s
        self._hand = hand
        self._reference = _moved_alike(*self._anchor, hand)
        self.released = self.released or message.released

    def waiting(self, now_s: float) -> bool:
        """Decide whether the robot waits where it is, for lack of input."""
        return self._anchor is None or now_s - self._last_input_s > INPUT_SILENCE_S

    def stop_here(self, robot: Array) -> None:
        """Anchor the reference here while waiting.

        The next input continues from here, without a jump. Shape (C,).
        """
        self._reference = robot.copy()

    def confine(self, reference: Array) -> None:
        """Anchor the reference here, where the robot was stopped from following.

        The hand then continues from here, without a detour. Shape (C,).
        """
        if self._hand is not None:
            self._anchor, self._reference = (self._hand, reference), reference

    def end_reason(self, now_s: float) -> Reason | None:
        """Return the reason why the input, or its absence, ends the coupling; None while it may continue."""
        if self.released:
            return because(Code.DRAG_ENDED)
        if now_s - self._last_input_s > INPUT_ABANDONED_S:
            return because(Code.NO_INPUT, limit_s=INPUT_ABANDONED_S)
        return None

    def reference(self, now_s: float) -> Array | None:
        """Return the robot's reference, or None while the robot waits for input. Shape (C,)."""
        return None if self.waiting(now_s) else self._reference

    def speed_scale(self, now_s: float) -> float:
        """Return the allowed share of the full speed now: low in the first second of driving."""
        driven_from_s = now_s if self._driven_from_s is None else self._driven_from_s
        return _RAMP_SPEED if now_s - driven_from_s < _RAMP_S else 1.0


def _hand_of(message: OperatorInput, n_coordinates: int) -> Array | None:
    """Return the hand's point, of the robot's kind; None if it is of another kind."""
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
    """Return the reference, moved and rotated as the hand was. Shapes (C,)."""
    if hand.size != POSE.n_coordinates:
        return reference + (hand - hand_before)
    before, now = TaskFrame.at(hand_before), TaskFrame.at(hand)
    moved = TaskFrame(now.A @ before.A.T, np.zeros(POSE.n_dims)).to_world(reference)
    moved[: POSE.n_dims] = reference[: POSE.n_dims] + (now.b - before.b)
    return moved
