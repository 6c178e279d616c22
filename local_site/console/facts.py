"""State of the operator's site for `farhand status`, taken from the console's picture."""

from __future__ import annotations

import math

from farhand.common.errors import FarhandError
from farhand.common.impairment.link_control import RelayControl
from farhand.common.mode_table import ControlMode
from farhand.common.process_status import LinkFacts, OperatorFacts
from farhand.common.wire.messages import EventKind, Wish
from farhand.common.wire.reason_words import sentence
from farhand.local_site.console.console import Console
from farhand.local_site.console.console_state import ConsoleState


def operator_facts(console: Console, page: str, control: RelayControl | None) -> OperatorFacts:
    """Return the state of a site.

    Args:
        console: Console of the site.
        page: Address of its page, empty without one.
        control: Control socket of the simulated link, None without one; it is asked now.
    """
    state, tick_age_s = console.picture, console.owner.tick_age_s
    robot, link = state.robot, state.link
    relay, relay_error = _relay_facts(control)
    return OperatorFacts(
        page=page,
        robot_mode=robot.mode if robot is not None else "",
        robot_phase=state.phase,
        robot_version=state.robot_version,
        robot_tasks=state.robot_tasks,
        robot_stopped_by_fault=_stopped_by_fault(state),
        holder=robot.holder if robot is not None else "",
        in_control=state.in_control,
        only_watches=state.wish is Wish.WATCH,
        why_not_in_control=sentence(state.why_not_in_control),
        link=link.health,
        silent_s=None if math.isinf(link.silent_s) else link.silent_s + tick_age_s,
        age_s=None if link.age_s is None else link.age_s + tick_age_s,
        round_trip_s=link.round_trip_s,
        not_understood=state.other_schema,
        relay=relay,
        relay_error=relay_error,
        waiting=console.owner.waiting,
        tick_age_s=tick_age_s,
    )


def _stopped_by_fault(state: ConsoleState) -> bool:
    """Distinguish a stop by a guard from one by an operator, which names a site."""
    if state.mode is not ControlMode.STOPPED:
        return False
    stop = next((notice for notice in reversed(state.notices) if notice.what == EventKind.STOPPED), None)
    return stop is not None and not stop.who


def _relay_facts(control: RelayControl | None) -> tuple[LinkFacts | None, str]:
    if control is None:
        return None, ""
    try:
        return LinkFacts.of(control.status()), ""
    except FarhandError as error:
        return None, str(error)
    except KeyError as error:
        return None, f"the simulated link is of another version: its status lacks {error}"
