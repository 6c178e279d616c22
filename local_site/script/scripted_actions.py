"""Actions of the scripted operator at a console: give a command, wait for its outcome, report.

The protocols name all that the script needs: a console, a link that can be cut, and real or virtual time.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal, Protocol

from farhand.common.clock import elapsed_s
from farhand.common.errors import FarhandError
from farhand.common.mode_table import Action, ControlMode
from farhand.common.wire.messages import ExecutionReport
from farhand.common.wire.reason_words import sentence
from farhand.common.wire.reasons import Code, Reason
from farhand.local_site.console import intents
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.console.intents import Intent
from farhand.local_site.exchange.notices import Notice

_log = logging.getLogger(__name__)

OutageKind = Literal["stall", "reset", "blackhole"]


@dataclass(frozen=True)
class PlannedOutage:
    """Planned cut of the link during the execution.

    Args:
        kind: Kind of outage.
        duration_s: Duration of the cut [s].
        at: Share of the previewed motion after which the cut begins, from 0 to 1.
    """

    kind: OutageKind
    duration_s: float
    at: float = 0.5


class OperatedConsole(Protocol):
    """Part of a `Console` that the script uses."""

    @property
    def picture(self) -> ConsoleState:
        """Present state of the console."""
        ...

    def submit(self, intent: Intent) -> None:
        """Submit an intent."""
        ...

    def wait_for(self, holds: Callable[[ConsoleState], bool], timeout_s: float) -> bool:
        """Wait until the picture satisfies a condition. Return False on a time-out."""
        ...

    def ask_report(self) -> ExecutionReport | None:
        """Ask the robot for the report of its newest execution; return None without an answer."""
        ...


class CuttableLink(Protocol):
    """Part of a `RelayControl` that the script uses."""

    def outage(self, kind: OutageKind, duration_s: float) -> Mapping[str, Any]:
        """Interrupt both directions for a while [s]."""
        ...

    def status(self) -> Mapping[str, Any]:
        """Return the settings and the traffic."""
        ...


class OperatorsTime(Protocol):
    """Time of the scripted operator."""

    def now_s(self) -> float:
        """Return the present time [s]."""
        ...

    def pause(self, duration_s: float) -> None:
        """Pause for a duration [s]."""
        ...


class RealTime:
    """Time of this machine."""

    def now_s(self) -> float:
        """Return the present time [s]."""
        return elapsed_s()

    def pause(self, duration_s: float) -> None:
        """See `OperatorsTime.pause`."""
        threading.Event().wait(duration_s)


PATIENCE_S = 60.0
ATTEMPTS = 3
_DENIALS = (Code.UNLISTED, Code.REVOKED, Code.OBSERVER, Code.OTHER_ROBOT)


class JobFailed(FarhandError):
    """Failure of the scripted job; its text names the step and the reason."""


class ScriptedActions:
    """Actions and observations of one scripted operator.

    Args:
        console: The operator's console.
        time: Time of the operator.
    """

    def __init__(self, console: OperatedConsole, time: OperatorsTime):
        self._console, self.time = console, time
        self._began_s = time.now_s()
        self.events: list[dict[str, Any]] = []
        """Announced texts with their times."""

    @property
    def picture(self) -> ConsoleState:
        """Present state of the console."""
        return self._console.picture

    def submit(self, *asked: intents.Intent) -> None:
        """Submit intents in turn."""
        for intent in asked:
            self._console.submit(intent)

    def until(
        self, what: str, holds: Callable[[ConsoleState], bool], patience_s: float = PATIENCE_S
    ) -> ConsoleState:
        """Wait until the picture satisfies a condition.

        Raises:
            JobFailed: On a time-out, or as soon as the robot says that this site may not command it.
        """
        if not self._console.wait_for(lambda p: holds(p) or _denial(p) is not None, patience_s):
            raise JobFailed(f"waited {patience_s:.0f} s for {what}: {self.last_words()}")
        state = self.picture
        if (denial := _denial(state)) is not None and not holds(state):
            raise JobFailed(sentence(denial))
        return state

    def command(self, action: Action, mode: ControlMode) -> None:
        """Give a command and wait for the robot's report of the mode; retry a limited number of times.

        Raises:
            JobFailed: When the robot did not reach that mode.
        """
        for _ in range(ATTEMPTS):
            if self.attempt(action, mode):
                return
        raise JobFailed(f"{action}: the robot did not reach {mode.name}: {self.last_words()}")

    def attempt(self, action: Action, mode: ControlMode) -> bool:
        """Give a command once; return whether the robot reports that mode.

        Raises:
            JobFailed: When this site does not get the control of the robot.
        """
        self.until("control of the robot", lambda p: p.in_control)
        n_answers, n_refusals = len(self.picture.command_round_trips_s), self._refusals(action, self.picture)

        def done(p: ConsoleState) -> bool:
            return len(p.command_round_trips_s) > n_answers and p.mode is mode

        self.submit(intents.CommandRobot(action))
        self._console.wait_for(
            lambda p: done(p) or self._refusals(action, p) > n_refusals or _denial(p) is not None, PATIENCE_S
        )
        if done(self.picture):
            took_s = self.picture.command_round_trips_s[-1]
            self.say(f"{action}: the robot is in {mode.name}, answered after {took_s:.3f} s")
            return True
        if self.picture.mode is mode:
            self.say(f"{action}: the robot was in {mode.name} already: {self.last_words()}")
            return True
        _log.warning("%s: %s", action, self.last_words())
        return False

    def manoeuvre(self, action: Action) -> bool:
        """Command a manoeuvre and wait for its end; return whether the robot reached its goal.

        Raises:
            JobFailed: When this site does not get the control of the robot, or no report of the end came.
        """
        self.until("control of the robot", lambda p: p.in_control)
        n_told = len(self._told(action, self.picture))
        self.submit(intents.CommandRobot(action))
        state = self.until(f"the end of {action}", lambda p: len(self._told(action, p)) > n_told)
        if self._told(action, state)[-1].good:
            self.until("the report of the mode after it", lambda p: p.mode is not ControlMode.AUTONOMOUS)
        self.say(f"{action}: {self._told(action, state)[-1].text}")
        return self._told(action, state)[-1].good

    def preview(self) -> bool:
        """Request a preview; return True for a preview, False for a refusal.

        Raises:
            JobFailed: When the robot sent neither.
        """
        before, n_refusals = self.picture.plan_id, self._refusals(Action.PREVIEW, self.picture)
        self.submit(intents.CommandRobot(Action.PREVIEW))
        state = self.until(
            "the preview",
            lambda p: (
                (p.plan_id > before and Action.PREVIEW not in p.pending)
                or self._refusals(Action.PREVIEW, p) > n_refusals
            ),
        )
        return state.plan_id > before

    def say(self, text: str) -> None:
        """Announce and log a text."""
        time_s = self.time.now_s() - self._began_s
        self.events.append({"time_s": round(time_s, 3), "text": text})
        _log.info("%6.2f s  %s", time_s, text)

    def last_words(self) -> str:
        """Return the last messages to the operator, which explain why the job did not continue."""
        told = [f"{notice.what}: {notice.text}" for notice in self.picture.notices[-3:]]
        return "; ".join(told) or "nothing was reported"

    @staticmethod
    def _refusals(action: Action, state: ConsoleState) -> int:
        return sum(not notice.good for notice in ScriptedActions._told(action, state))

    @staticmethod
    def _told(action: Action, state: ConsoleState) -> list[Notice]:
        return [notice for notice in state.notices if notice.what == action]


def _denial(state: ConsoleState) -> Reason | None:
    """Return why this site may never command the robot, None if it may."""
    why = state.why_not_in_control
    return why if why is not None and why.code in _DENIALS else None
