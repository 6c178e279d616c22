"""Skill of inserting or extracting a plug by sight and touch, on any `InsertionArm`.

Manoeuvres at a receptacle move along the axis of the bore, without sideways motion inside. In the frame of the receptacle the mouth is the origin, and z points into the bore.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from farhand.common.mode_table import Action, Phase
from farhand.common.task import AnyTask, ArmTask
from farhand.common.wire.reasons import Code, Reason, because
from farhand.remote_site.insertion.jams_and_retries import Recovery
from farhand.remote_site.insertion.sight_and_touch import (
    BACK_M_S,
    InsertionArm,
    ReceptacleEstimator,
    TrackedPerception,
    pose_of,
)
from farhand.remote_site.interface.embodiment import Belief, Check, ExaminePath, Guidance
from farhand.remote_site.interface.goals import (
    BACK_OFF_M,
    BACK_OFF_S,
    SPEED,
    FixedGoal,
    ManoeuvreGoal,
    giving_way,
    patience_s,
)
from farhand.remote_site.interface.plant import EffectorState
from farhand.remote_site.interface.sensing import Sensing
from farhand.remote_site.reproduction.executor_settings import Path

Array = NDArray[np.float64]

IN_BORE_M_S = 0.03
"""Speed of manoeuvres where the plug touches, or may touch [m/s]."""
_LEAD_M = 0.020
"""Largest lead of the hand over a plug in the bore [m]."""
_BESIDE_M = 0.040
"""Distance from the axis beyond which no plug is in the bore, whatever the error of sight [m]."""


class AlongAxis:
    """Goal pose that moves with the receptacle.

    Args:
        local: Goal pose in the frame of the receptacle. Shape (7,).
        sensing: Newest measurements, with the receptacle's frame.
        arm: The arm, which knows whether the plug is near the receptacle.
        speed_m_s: Speed in free water [m/s].
        distance_m: Length of the path [m].
        time_limit_s: See `ManoeuvreGoal`; derived from the distance when not given.
    """

    def __init__(
        self,
        local: Array,
        sensing: Sensing,
        arm: InsertionArm,
        speed_m_s: float,
        distance_m: float,
        time_limit_s: float | None = None,
    ):
        self._local, self._sensing, self._arm, self._speed = local, sensing, arm, speed_m_s
        self.time_limit_s = patience_s(distance_m, IN_BORE_M_S) if time_limit_s is None else time_limit_s

    def goal(self) -> Array:
        """See `ManoeuvreGoal`."""
        return self._sensing.goal.to_world(self._local)

    def speed_m_s(self) -> float:
        """See `ManoeuvreGoal`."""
        return min(self._speed, IN_BORE_M_S) if self._arm.near else self._speed


def shifted(sensing: Sensing, by_m: Array) -> Array:
    """Return the tip's pose in the receptacle's frame, displaced along its axes. Shapes (3,), (7,)."""
    local = sensing.goal.to_local(sensing.effector.controlled[0])
    local[:3] += by_m
    return local


def in_bore(sensing: Sensing) -> bool:
    """Decide whether the tip is estimated to be behind the mouth."""
    if not np.isfinite(sensing.unseen_s):
        return False
    x, y, z = sensing.goal.to_local(sensing.effector.point)[:3]
    return bool(z > 0.0 and np.hypot(x, y) < _BESIDE_M)


def confined(reference: Array, sensing: Sensing) -> Array:
    """Confine the operator's reference: inside the bore the plug moves along the axis only. Shapes (7,)."""
    if not in_bore(sensing):
        return reference
    axis, at = sensing.goal.A[:, 2], sensing.effector.controlled[0].copy()
    along_m = float((reference[:3] - at[:3]) @ axis)
    at[:3] += min(max(along_m, -_LEAD_M), _LEAD_M) * axis
    return at


def free_speed_m_s(fastest_m_s: float) -> float:
    """Return the speed of manoeuvres in free water [m/s]."""
    return SPEED * fastest_m_s


Examine = Callable[[EffectorState, Array | None, Path], Check]
"""Function that examines a planned motion from a state of the arm, also straight into a receptacle, if it is to enter one. Shape (7,)."""

_LOOK_S = 0.5
"""Time before an execution in which the receptacle is observed and the wrist's sensor tared [s]."""
_DEPTH_M, _LATERAL_M = (0.075, 0.095), 0.010
"""Range of the depth, and largest distance from the axis, of a seated plug in the estimated frame [m].

The latter allows for the error of sight.
"""


class InsertionSkill:
    """Skill of inserting and extracting.

    The first task frame is the receptacle's: origin in the mouth, z into the bore.

    Args:
        task: The first task.
        arm: Arm that moves the plug.
        perception: Sight of the receptacle.
        ready: Goal pose of Go to ready. Shape (7,).
        max_speed_m_s: Speed limit of the tip, in every mode [m/s].
        new_recovery: Makes the recovery of an execution; its argument is True if the plug enters the bore.
        examine: Examines a motion before it begins; None for no examination.
    """

    def __init__(
        self,
        task: ArmTask,
        arm: InsertionArm,
        perception: TrackedPerception,
        ready: Array,
        max_speed_m_s: float,
        new_recovery: Callable[[bool], Recovery] = lambda enters: Recovery(enters=enters),
        examine: Examine | None = None,
    ):
        self.task, self._arm, self._ready, self._examine = task, arm, ready, examine
        self._speed_m_s, self._new_recovery = free_speed_m_s(max_speed_m_s), new_recovery
        self._touch = ReceptacleEstimator(perception, new_recovery(self.must_seat), _LOOK_S)
        self._look_until_s = -np.inf

    @property
    def must_seat(self) -> bool:
        """See `Skill`."""
        return self.task.skill == "insert"

    # In every control period ---------------------------------------------------------------------

    def believe(self, sensing: Sensing, executing: bool, now_s: float, dt_s: float) -> Belief:
        """See `Skill`."""
        waits = now_s < self._look_until_s
        felt = self._touch.update(sensing, executing and not waits, now_s, dt_s)
        given_up = because(Code.JAMMED) if self._touch.recovery.given_up else None
        return Belief(
            felt.frames, Guidance(waits, felt.back, BACK_M_S, given_up, felt.receptacle, felt.presses)
        )

    def apply(self, guidance: Guidance) -> None:
        """See `Skill`."""
        if guidance.receptacle is not None:
            self._arm.set_receptacle(guidance.receptacle, guidance.presses)

    def begin(self, task: AnyTask, now_s: float) -> None:
        """See `Skill`; in free water the correction by contact is reset, and the wrist's sensor tared."""
        assert isinstance(task, ArmTask)
        self.task = task
        recovery = self._new_recovery(self.must_seat)
        if self._arm.near:
            recovery.correction = self._touch.recovery.correction
        else:
            self._arm.tare()
        self._touch.begin(recovery)
        self._look_until_s = now_s + _LOOK_S

    def confined(self, reference: Array, sensing: Sensing) -> Array:
        """See `Skill`."""
        return confined(reference, sensing)

    def end_phase(self, sensing: Sensing) -> Phase:
        """See `Skill`."""
        x, y, z = sensing.goal.to_local(sensing.effector.point)[:3]
        inside = _DEPTH_M[0] <= z <= _DEPTH_M[1] and np.hypot(x, y) < _LATERAL_M
        force_n = sensing.effector.contact_n or 0.0
        pressed = self._arm.seated or force_n >= self.task.limits.contact_n
        return Phase.SEATED if inside and pressed else Phase.ARRIVED

    # What is asked -------------------------------------------------------------------------------

    def goal(self, phase: Phase, sensing: Sensing) -> ManoeuvreGoal | None:
        """See `Skill`."""
        if phase is Phase.BACKING_OFF and not np.isfinite(sensing.unseen_s):
            return giving_way(sensing.effector, self._speed_m_s)
        along = partial(AlongAxis, sensing=sensing, arm=self._arm, speed_m_s=self._speed_m_s)
        if phase is Phase.BACKING_OFF:
            back = shifted(sensing, np.array([0.0, 0.0, -BACK_OFF_M]))
            return along(back, distance_m=BACK_OFF_M, time_limit_s=BACK_OFF_S)
        if phase is Phase.RETRACTING and self.task.retract_m is not None:
            by_m = np.array(self.task.retract_m)
            return along(shifted(sensing, by_m), distance_m=float(np.linalg.norm(by_m)))
        if phase is Phase.GOING_TO_READY:
            return FixedGoal.to(self._ready, sensing.effector.point, self._speed_m_s)
        return None

    def refusal(self, action: Action, sensing: Sensing) -> Reason | None:
        """See `Skill`."""
        if action is Action.GO_TO_READY and in_bore(sensing):
            return because(Code.IN_RECEPTACLE)
        if action is Action.RETRACT and not np.isfinite(sensing.unseen_s):
            return because(Code.WAY_OUT_UNKNOWN)
        return None

    def check(self, task: AnyTask, sensing: Sensing) -> ExaminePath | None:
        """See `Skill`; an insertion has its path into the bore examined, too."""
        assert isinstance(task, ArmTask)
        if self._examine is None:
            return None
        receptacle = pose_of(sensing.goal) if task.skill == "insert" else None
        return partial(self._examine, sensing.effector, receptacle)
