"""Executions that the robot has told of: when each began, of which model, how it ended, and what the robot measured."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

from farhand.common.mode_table import Action
from farhand.common.wire import keys
from farhand.common.wire.messages import Event, EventKind, ExecutionReport, ReportRequest
from farhand.common.wire.reasons import Code, Reason, because
from farhand.local_site.exchange.requests import Requests
from farhand.local_site.teaching.library import Library

KEPT = 100
"""Largest number of executions that are remembered."""
_GIVE_UP_S = 60.0


@dataclass(frozen=True)
class ReportedExecution:
    """Execution as the robot has reported it.

    Args:
        command_id: Id of the command that began it.
        boot: Boot of the robot.
        began_ns: Time of its beginning on the robot's clock [ns]; None while only its end is known.
        began_s: The same on the console's clock [s]; that of the event of its end while only this is known.
        task: Name of the task; empty while only its end is known.
        model: First digits of the model's SHA-256.
        revision: Number of this site's revision with that model; 0 for a model that this site does not keep.
        ended: Outcome, or the reason of its end; None while no end was told.
        ended_ns: Time of its end on the robot's clock [ns]; None while unknown.
        report: Robot's measurements, once it has answered.
    """

    command_id: str
    boot: str
    began_ns: int | None
    began_s: float
    task: str = ""
    model: str = ""
    revision: int = 0
    ended: Reason | None = None
    ended_ns: int | None = None
    report: ExecutionReport | None = None

    @property
    def reached_end(self) -> bool:
        """True if the motion reached its end: the robot arrived, or its tool is seated."""
        return self.ended is not None and self.ended.code == Code.AT_END

    @property
    def took_s(self) -> float | None:
        """Time from its beginning to its end [s]; None while unknown."""
        if self.ended is not None and self.reached_end:
            return self.ended.measured
        if self.began_ns is None or self.ended_ns is None:
            return None
        return 1e-9 * (self.ended_ns - self.began_ns)


@dataclass(frozen=True)
class Executions:
    """Remembered executions, the newest first.

    Args:
        newest: Each of them.
    """

    newest: tuple[ReportedExecution, ...] = ()

    @property
    def n_ended(self) -> int:
        """Number of executions whose end was told."""
        return sum(each.ended is not None for each in self.newest)

    @property
    def n_reached_end(self) -> int:
        """Number of executions that reached the end of their motion."""
        return sum(each.reached_end for each in self.newest)


class ExecutionHistory:
    """Owner of the remembered executions. Used by the console's thread alone.

    Args:
        inquiries: Asks the robot for its measurements.
        library: Lessons of all tasks, whose revisions are named.
    """

    def __init__(self, inquiries: Requests, library: Library):
        self._inquiries, self._library = inquiries, library
        self._asked = ""
        self.known = Executions()
        """All known executions; another object whenever something has changed."""

    def on_event(self, event: Event, at_s: float) -> None:
        """Process an event of the robot. Events that an outage held up may come after later ones.

        Args:
            event: Event.
            at_s: Time at which it happened, on the console's clock [s].
        """
        known = self._find(event.command_id) or ReportedExecution(
            event.command_id, event.stamp.boot, None, at_s
        )
        if event.kind == EventKind.EXECUTING:
            task, _, model = _value(event.reason, "model").rpartition(" ")
            revision = self._revision(task, model)
            self._keep(
                replace(
                    known, began_ns=event.stamp.t_ns, began_s=at_s, task=task, model=model, revision=revision
                )
            )
        elif event.action == Action.EXECUTE and event.kind in (EventKind.COMPLETED, EventKind.FAILED):
            self._keep(replace(known, ended=event.reason, ended_ns=event.stamp.t_ns))

    def on_restart(self, boot: str) -> None:
        """Process a restart of the robot, which has interrupted what it executed.

        Args:
            boot: Its present boot.
        """
        self.known = Executions(
            tuple(
                replace(each, ended=because(Code.INTERRUPTED, model=each.model))
                if each.ended is None and each.boot != boot
                else each
                for each in self.known.newest
            )
        )

    def tick(self) -> None:
        """Ask the robot once for its measurements of the newest execution, after its end."""
        newest = self.known.newest[0] if self.known.newest else None
        if newest is None or newest.ended is None or newest.began_ns is None:
            return
        if newest.command_id != self._asked and newest.ended.code != Code.INTERRUPTED:
            self._asked = asked = newest.command_id
            self._inquiries.ask(
                keys.REPORT, ReportRequest(), ExecutionReport, _GIVE_UP_S, partial(self._on_report, asked),
                wanted=lambda: self.known.newest[0].command_id == asked,
            )  # fmt: skip

    def _on_report(self, command_id: str, report: ExecutionReport | None, _took_s: float) -> None:
        """Keep the measurements if they are of this execution, and not of a later one."""
        asked = self._find(command_id)
        if report is None or report.began is None or asked is None or asked.began_ns is None:
            return
        if report.began.boot == asked.boot and report.began.t_ns <= asked.began_ns:
            self._keep(replace(asked, report=report))

    def _revision(self, task: str, model: str) -> int:
        """Return the number of the revision with a model, given by its first digits; 0 for none."""
        taught = self._library.by_task.get(task)
        if taught is None or not model:
            return 0
        return next((each.number for each in taught.revisions if each.sha256.startswith(model)), 0)

    def _find(self, command_id: str) -> ReportedExecution | None:
        return next((each for each in self.known.newest if each.command_id == command_id), None)

    def _keep(self, changed: ReportedExecution) -> None:
        """Put an execution in its place by its time, and forget the oldest ones where there are too many."""
        others = [each for each in self.known.newest if each.command_id != changed.command_id]
        ordered = sorted([changed, *others], key=lambda each: each.began_s, reverse=True)
        self.known = Executions(tuple(ordered[:KEPT]))


def _value(reason: Reason, name: str) -> str:
    """Return a name among a reason's values; empty without it."""
    return next((str(each.value) for each in reason.values if each.name == name), "")
