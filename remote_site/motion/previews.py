"""Pending previews: which command waits for which plan. A newer preview replaces an older one."""

from __future__ import annotations

from farhand.common.wire.messages import Command, PlannedPath, Stamp
from farhand.remote_site.motion.model_trial import StoredModel
from farhand.remote_site.motion.planner import PlanRequest
from farhand.remote_site.motion.plans import Plans


class Previews:
    """Register of the one preview that may wait for its plan.

    Args:
        plans: Makes and keeps the plans.
    """

    def __init__(self, plans: Plans):
        self._plans = plans
        self._plan_id = 0
        self._command: Command | None = None

    def begin(self, command: Command, stored: StoredModel, now: Stamp) -> Command | None:
        """Request a plan for a command. Return the command that it replaces, if one was waiting."""
        replaced = self._command
        self._plan_id, self._command = self._plans.preview(stored, now), command
        return replaced

    def finish(self, request: PlanRequest, path: PlannedPath | None) -> Command | None:
        """Finish a plan that was made, or failed. Return the command that waits for it, if any."""
        if self._command is None or request.plan_id != self._plan_id:
            return None
        command, self._command = self._command, None
        if path is not None:
            self._plans.shown(request)
        return command
