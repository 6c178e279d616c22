"""Silence of the operator: what the robot does when the hand, or the whole site, is no longer heard.

- Half a second without an input of the hand: the robot waits where it is, and the next input re-anchors
  (`Coupling.waiting`). After ten seconds the coupling ends (`Coupling.end_reason`).
- Half a second without any message, beyond the link's usual delay: the coupling ends (`OperatorSession.lost_reason`).
- Three seconds, likewise: the link is lost. An execution continues, pauses or retracts, as its task says.
- A minute in a pause without sight of the target, with the link lost: the robot retracts if the task allows it.
"""

from __future__ import annotations

from farhand.common.mode_table import Guard
from farhand.common.task import Task
from farhand.common.wire.reasons import Code, Reason, because
from farhand.remote_site.motion.coupling import Coupling
from farhand.remote_site.supervision.operator_session import OperatorSession

LINK_LOST_S = 3.0
"""Silence beyond the link's usual delay after which it is lost."""
BLIND_AND_ALONE_S = 60.0


class CouplingGuard:
    """Guard of a coupling: it ends with its lease, by silence, or when the hand lets go.

    Args:
        contact: The operator's messages.
    """

    def __init__(self, contact: OperatorSession):
        self._contact = contact

    def reason(self, coupling: Coupling | None, now_s: float) -> Reason | None:
        """Return the reason why a coupling ends now; None while it may continue, and without one."""
        if coupling is None:
            self._contact.delay_changed = False  # nobody drives by the old delay
            return None
        return self._contact.lost_reason(coupling.lease_id, now_s) or coupling.end_reason(now_s)


class LinkGuard:
    """Guard of the link: it applies the task's policy once for each loss."""

    def __init__(self) -> None:
        self._acted = False
        self._blind_and_alone_s = 0.0

    def lost(
        self, task: Task, silent_s: float, executing: bool, blind: bool, dt_s: float
    ) -> tuple[Guard, Reason] | None:
        """Return the guard that trips by the policy now, with its reason; None for none.

        Args:
            task: The present task, with its policy.
            silent_s: Excess of the silence over the link's usual delay [s].
            executing: True while a model is executed.
            blind: True while an execution is paused without sight of its target.
            dt_s: Control period [s].
        """
        lost = silent_s > LINK_LOST_S
        self._acted = self._acted and lost
        self._blind_and_alone_s = self._blind_and_alone_s + dt_s if lost and blind else 0.0
        if task.blind_retract and self._blind_and_alone_s > BLIND_AND_ALONE_S:
            self._blind_and_alone_s = 0.0
            return Guard.LINK_LOST_RETRACT, because(Code.BLIND_AND_ALONE)
        if not lost or self._acted or not executing or task.lost_link == "continue":
            return None
        self._acted = True
        hold = task.lost_link == "hold"
        why = because(Code.LINK_LOST, silent_s=silent_s, policy="pauses" if hold else "retracts")
        return (Guard.LINK_LOST_HOLD if hold else Guard.LINK_LOST_RETRACT), why
