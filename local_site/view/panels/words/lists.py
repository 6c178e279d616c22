"""Words of lists and notes: events, executions, revisions, standing of the tasks, roles of the tabs, and the simulated link."""

from __future__ import annotations

import math

from farhand.common.wire.messages import ExecutionReport
from farhand.common.wire.reason_words import sentence
from farhand.local_site.console.console_state import TaskStanding
from farhand.local_site.console.executions import Executions, ReportedExecution
from farhand.local_site.exchange.notices import Notice
from farhand.local_site.teaching.revisions import Revision
from farhand.local_site.view.panels.words.controls import THIS_PAGE
from farhand.local_site.view.sessions import OBJECT_S, Role

LATE_S = 2.0
"""An event that was so long on its way was held up by an outage, and is shown when it happened [s]."""
NOT_DONE = "Nothing was done: this tab only watches. Press Take over to act here."
ASKED = f"Asked to take over: this tab becomes the active one in {OBJECT_S:.0f} s, unless the other one keeps control."
TAKES_OVER = f"Another tab takes over in {OBJECT_S:.0f} s, unless you keep control."
KEPT = "The other tab keeps control. STOP works here too."
ROLE_WORDS = {
    Role.ACTIVE: "",
    Role.WATCHING: "This tab watches: another one is active. STOP works here too. Take over makes this one active.",
    Role.FREE: "No tab is active: act here to take over.",
}
_ENOUGH_BPS = 1e6
"""Capacity at which everything that the sites send has room, whatever they were told [bit/s]."""


def loss_words(transport: str, in_bursts: bool) -> str:
    """Return what to know about the simulated link's loss; empty where its slider tells all.

    Args:
        transport: Transport of the present connections, "tcp" or "udp"; empty without any.
        in_bursts: True if datagrams are lost in bursts, which the slider does not show.
    """
    if transport == "tcp":
        return "A TCP connection loses no packets: loss and a change of ports need QUIC (no --transport)."
    if transport == "udp" and in_bursts:
        return "Loss comes in bursts, as set at the link's control socket; the slider replaces them."
    return ""


def too_slow_words(rate_bps: float, told_bps: float) -> str:
    """Return a warning of a link that carries less than the sites were told; empty without one.

    Args:
        rate_bps: Capacity of the simulated link [bit/s]; 0 for more than enough.
        told_bps: Capacity that the sites were told at their start [bit/s]; 0 for more than enough.
    """
    if not 0.0 < rate_bps < _ENOUGH_BPS or 0.0 < told_bps <= rate_bps:
        return ""
    return (
        f"This link carries {rate_bps:g} bit/s and the sites were told more, so that what they send comes later and later: "
        f"start both with --link-rate-bps={rate_bps:g}."
    )


def count_words(executions: Executions) -> str:
    """Return the share of the executions that reached the end of their motion, in words."""
    n = executions.n_ended
    return f"{executions.n_reached_end} of {n} ended as they should" if n else "none has ended yet"


def outcome_words(execution: ReportedExecution, newest: bool) -> str:
    """Return how an execution ended, or that it has not.

    Args:
        execution: Execution.
        newest: True if it is the newest: another one without an end is over, though nobody told why.
    """
    if execution.ended is None:
        return "under way" if newest else "its end was not told"
    if execution.reached_end:
        phase = (each.value for each in execution.ended.values if each.name == "phase")
        return str(next(phase, "at its end"))
    return sentence(execution.ended)


def at_the_end(report: ExecutionReport) -> str:
    """Return the place at which an execution ended as the robot measured it; empty where it cannot know."""
    parts = []
    if report.depth_m is not None:
        side = "deep" if report.depth_m >= 0.0 else "before the mouth"
        parts.append(f"{1e3 * abs(report.depth_m):.0f} mm {side}")
    if report.lateral_m is not None:
        parts.append(f"{1e3 * report.lateral_m:.1f} mm beside")
    if report.end_error_m is not None:
        parts.append(f"{1e3 * report.end_error_m:.0f} mm off")
    return ", ".join(parts)


def upload_words(most_bytes: int) -> str:
    """Return what can be uploaded.

    Args:
        most_bytes: Largest size of a file [B].
    """
    return (
        f"Upload: a .npz as downloaded here, or made by farhand import, of at most {1e-6 * most_bytes:g} MB."
    )


def standing_words(task: TaskStanding) -> str:
    """Return a task's number of demonstrations, and whether the robot has the model, as text."""
    n = task.n_demonstrations
    if not task.robot_does:
        return "not done by this robot"
    if not n:
        return "not taught"
    robot = (
        "on its way"
        if task.sending_sha256
        else "asking the robot"
        if task.asking
        else "robot lacks it"
        if task.differs
        else "robot has it"
    )
    return f"{n} demonstration{'' if n == 1 else 's'}, {robot}"


def demonstration_label(number: int, source: str, seconds: float) -> str:
    """Return the name of a demonstration in its list."""
    return f"{number}: {(source or THIS_PAGE)[:40]}, {seconds:.1f} s"


def number_words(number: int, hidden: bool) -> str:
    """Return the number of a demonstration in its table, and whether it is not drawn."""
    return f"{number}, hidden" if hidden else f"{number}"


def model_name(model: str) -> str:
    """Return the name of a model of another site or session, by its hash."""
    return f"model {model}"


def made_words(at: str) -> str:
    """Return when a revision was made."""
    return f"made at {at}"


def link_name(profile: str) -> str:
    """Return the name of the link by that of its simulated profile."""
    return f"{profile} link" if profile else "link"


def cut_words(remaining_s: float) -> str:
    """Return how long the simulated link stays cut."""
    return f"cut: {math.ceil(remaining_s)} s left"


def event_words(notice: Notice) -> str:
    """Return the event as one line."""
    late = f", heard {notice.late_s:.0f} s later" if notice.late_s > LATE_S else ""
    by = f" [{notice.who}]" if notice.who else ""
    if notice.text.startswith(notice.what) and not by:
        return f"{notice.text}{late}"  # avoids "executing: executing hot-stab"
    return f"{notice.what}{by}: {notice.text}{late}"


def robot_clock(notice: Notice) -> str:
    """Return the time of an event on the clock that applies to it."""
    if notice.robot_s is None:
        return "this site's own; its clock"
    return f"{notice.robot_s:.2f} s on the robot's clock; the time shown is this site's"


def revision_label(revision: Revision) -> str:
    """Return the name of a revision in its list."""
    n = len(revision.demonstrations)
    return f"{revision.number}: {n} demonstration{'' if n == 1 else 's'}"
