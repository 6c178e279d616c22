"""Direct teleoperation: the robot follows the difference of the operator's hand from its anchor."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from common.messages import OperatorInput

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
        self._offset: Array | None = None
        self._reference: Array | None = None
        self.released = False

    def feed(self, message: OperatorInput, robot_position_m: Array, now_s: float) -> None:
        """Take one input of the operator; late, repeated and misshapen ones are ignored.

        Args:
            message: The input, already checked for age, lease and coupling.
            robot_position_m: Where the robot is: the anchor of a new beginning. Shape (D,) [m].
            now_s: Now [s].
        """
        if message.seq <= self.newest_seq or len(message.position_m) != robot_position_m.size:
            return
        self.newest_seq = message.seq
        hand = np.array(message.position_m)
        if self._offset is None or self.waiting(now_s):
            # Anchor: from here on the robot follows the hand's difference, so nothing jumps.
            anchor = self._reference if self._reference is not None else robot_position_m
            self._offset = anchor - hand
        if self._driven_from_s is None:
            self._driven_from_s = now_s
        self._last_input_s = now_s
        self._reference = hand + self._offset
        self.released = self.released or message.released

    def waiting(self, now_s: float) -> bool:
        """Whether the robot waits where it is, for want of input."""
        return self._offset is None or now_s - self._last_input_s > INPUT_SILENCE_S

    def stop_here(self, robot_position_m: Array) -> None:
        """While waiting: what the operator reaches next continues from here, without a jump."""
        self._reference = robot_position_m.copy()

    def end_reason(self, now_s: float) -> str:
        """Why the coupling ends by what the hand did or did not do; empty while it may go on."""
        if self.released:
            return "the drag ended"
        if now_s - self._last_input_s > INPUT_ABANDONED_S:
            return f"there was no input for {INPUT_ABANDONED_S:.0f} s"
        return ""

    def reference_m(self, now_s: float) -> Array | None:
        """Where the robot should be. Shape (D,) [m]. None while it waits for input."""
        return None if self.waiting(now_s) else self._reference

    def speed_scale(self, now_s: float) -> float:
        """Part of the full speed that is allowed now: slow in the first second of driving."""
        driven_from_s = now_s if self._driven_from_s is None else self._driven_from_s
        return _RAMP_SPEED if now_s - driven_from_s < _RAMP_S else 1.0
