"""Scripted operator's whole job in virtual time: the console, the link and the time around both sites."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import msgspec

from farhand.common.impairment.impairment import LinkSettings
from farhand.common.mode_table import Phase
from farhand.common.wire.messages import ExecutionReport
from farhand.evaluation.harness.virtual_sites import VirtualSites
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.console.intents import Intent
from farhand.local_site.script.scripted_actions import OutageKind, PlannedOutage
from farhand.local_site.script.scripted_operator import ScriptedOperator

_STEP_S = 0.02
_REPORT_S = 15.0


class VirtualPlace:
    """Surroundings of a `ScriptedOperator` in virtual time: waiting advances the time.

    Args:
        sites: Both sites.
        settings: Settings of the link, for the record.
    """

    def __init__(self, sites: VirtualSites, settings: LinkSettings):
        self._sites, self._settings = sites, settings
        self.cut_in = Phase.NONE
        """Phase of the robot when the link was cut."""

    # The console --------------------------------------------------------------------------------

    @property
    def picture(self) -> ConsoleState:
        """See `OperatedConsole.picture`."""
        return self._sites.console.picture

    def submit(self, intent: Intent) -> None:
        """See `OperatedConsole.submit`."""
        self._sites.console.submit(intent)
        self._sites.run(0.0)

    def wait_for(self, holds: Callable[[ConsoleState], bool], timeout_s: float) -> bool:
        """See `OperatedConsole.wait_for`."""
        return self._run_until(lambda: holds(self.picture), timeout_s)

    def ask_report(self) -> ExecutionReport | None:
        """See `OperatedConsole.ask_report`."""
        answers: list[ExecutionReport | None] = []
        self._sites.console.request_report(answers.append)
        self._run_until(lambda: bool(answers), _REPORT_S)
        return answers[0] if answers else None

    # The link -----------------------------------------------------------------------------------

    def outage(self, kind: OutageKind, duration_s: float) -> Mapping[str, Any]:
        """See `CuttableLink.outage`."""
        link, execution = self._sites.link, self._sites.robot.supervisor.motion.execution
        self.cut_in = execution.phase if execution else Phase.NONE
        match kind:
            case "stall":
                link.stall(duration_s)
            case "reset":
                link.cut()
                self._sites.time.call_later(duration_s, link.mend)
            case "blackhole":
                link.swallow(duration_s)
        return self.status()

    def status(self) -> Mapping[str, Any]:
        """See `CuttableLink.status`."""
        return {"profile": "virtual", "settings": msgspec.to_builtins(self._settings)}

    # The time -----------------------------------------------------------------------------------

    def now_s(self) -> float:
        """See `OperatorsTime.now_s`."""
        return self._sites.time.now_s()

    def pause(self, duration_s: float) -> None:
        """See `OperatorsTime.pause`."""
        self._sites.run(duration_s)

    def _run_until(self, holds: Callable[[], bool], timeout_s: float) -> bool:
        give_up_s = self.now_s() + timeout_s
        while not holds() and self.now_s() < give_up_s:
            self._sites.run(_STEP_S)
        return holds()


def do_job(
    sites: VirtualSites, settings: LinkSettings, outage: PlannedOutage | None, seed: int
) -> dict[str, Any]:
    """Run the scripted operator's job once.

    Args:
        sites: Both sites, unused so far.
        settings: Settings of their link.
        outage: Planned cut, or None.
        seed: Seed of the hand.

    Returns:
        What `farhand demo --json` writes, and `cut_in`, the phase of the robot when the link was cut.

    Raises:
        JobFailed: When a step failed.
    """
    place = VirtualPlace(sites, settings)
    result = ScriptedOperator(place, sites.library.tasks, place, outage, seed, place).run()
    return {**result, "cut_in": place.cut_in.name}
