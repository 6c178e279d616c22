"""What the robot notices by itself: force, sight of the target, the link. Each says why it acts, or nothing.

The guards decide; the supervisor looks up in the table of modes what follows.
"""

from __future__ import annotations

import math

from farhand.common.control_mode import Guard
from farhand.common.task import Limits, Task
from farhand.remote_site.interface.plant import EffectorState
from farhand.remote_site.perception.sensing import PREDICTED_S, Sensing

FORCE_FOR_S = 0.05
SIGHT_PATIENCE_S = 5.0
"""Seen again within this time, an execution goes on by itself."""
SIGHT_MOVED_M = 0.020
SIGHT_TURNED_RAD = math.radians(3.0)
LINK_LOST_S = 3.0
"""Silence beyond the link's usual delay after which it is lost."""
BLIND_AND_ALONE_S = 60.0


class ForceGuard:
    """Trips when the force on the tool is too high for too long, or far too high at once.

    Args:
        limits: Of the task.
    """

    def __init__(self, limits: Limits):
        self._limits = limits
        self._above_s = 0.0

    def reason(self, effector: EffectorState, dt_s: float) -> tuple[str, float | None]:
        """Why it trips now, and the force [N]; an empty reason when it does not."""
        force_n = effector.contact_n
        if force_n is None:
            return "", None
        self._above_s = self._above_s + dt_s if force_n > self._limits.force_n else 0.0
        if force_n > self._limits.force_peak_n:
            return f"the force of {force_n:.0f} N is above {self._limits.force_peak_n:.0f} N", force_n
        if self._above_s >= FORCE_FOR_S:
            return f"the force of {force_n:.0f} N is above {self._limits.force_n:.0f} N", force_n
        return "", None


class SightGuard:
    """Lets an execution go on without sight of its target for a moment, wait for a while, then pause.

    Args:
        sensing: When the frames were seen.
    """

    def __init__(self, sensing: Sensing):
        self._sensing = sensing

    @property
    def must_wait(self) -> bool:
        """Whether an execution slows to a stop: a prediction is not good for longer."""
        return self._sensing.unseen_s > PREDICTED_S

    def reason(self) -> tuple[str, float | None]:
        """Why an execution cannot go on, and the measured value; an empty reason while it can."""
        sensed = self._sensing
        if sensed.unseen_s > SIGHT_PATIENCE_S:
            return f"perception lost: the target was not seen for {SIGHT_PATIENCE_S:.0f} s", sensed.unseen_s
        again = sensed.seen_again
        if again is None or again.gap_s <= PREDICTED_S:
            return "", None
        if again.moved_m > SIGHT_MOVED_M:
            return f"perception lost: the target came back {again.moved_m * 1e3:.0f} mm off", again.moved_m
        if again.turned_rad > SIGHT_TURNED_RAD:
            degrees = math.degrees(again.turned_rad)
            return f"perception lost: the target came back turned by {degrees:.0f} degrees", again.turned_rad
        return "", None


class LinkGuard:
    """Applies the task's policy for a lost link, once for each loss."""

    def __init__(self) -> None:
        self._acted = False
        self._blind_and_alone_s = 0.0

    def trip(
        self, task: Task, silent_s: float, executing: bool, blind: bool, dt_s: float
    ) -> tuple[Guard | None, str]:  # fmt: skip
        """What follows from the link's silence now.

        Args:
            task: The present one; its policy counts.
            silent_s: For how long nothing was heard, beyond what is usual [s].
            executing: Whether a model is executed.
            blind: Whether the execution is paused for want of sight.
            dt_s: Control period [s].
        """
        lost = silent_s > LINK_LOST_S
        self._acted = self._acted and lost
        self._blind_and_alone_s = self._blind_and_alone_s + dt_s if lost and blind else 0.0
        if task.blind_retract and self._blind_and_alone_s > BLIND_AND_ALONE_S:
            self._blind_and_alone_s = 0.0
            return Guard.LINK_LOST_RETRACT, "neither the target was seen nor the link heard for a minute"
        if not lost or self._acted or not executing or task.lost_link == "continue":
            return None, ""
        self._acted = True
        hold = task.lost_link == "hold"
        guard = Guard.LINK_LOST_HOLD if hold else Guard.LINK_LOST_RETRACT
        return (
            guard,
            f"the link is lost for {silent_s:.1f} s: this task then {'pauses' if hold else 'retracts'}",
        )
