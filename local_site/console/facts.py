"""State of the operator's site for `farhand status`, taken from the console's picture."""

from __future__ import annotations

import math

from farhand.common.control_mode import ControlMode
from farhand.common.errors import FarhandError
from farhand.common.impairment.link_control import RelayControl
from farhand.common.process_status import LinkFacts, OperatorFacts
from farhand.common.wire.messages import EventKind, Wish
from farhand.common.wire.words import sentence
from farhand.local_site.console.console import Console
from farhand.local_site.console.console_state import ConsoleState


def operator_facts(console: Console, page: str, control: RelayControl | None) -> OperatorFacts:
    """Return the state of a site.

    Args:
        console: Console of the site.
        page: Address of its page, empty without one.
        control: Control socket of the simulated link, None without one; it is asked now.
    """
    picture, tick_age_s = console.picture, console.owner.tick_age_s
    robot, link = picture.robot, picture.link
    relay, relay_error = _relay_facts(control)
    return OperatorFacts(
        page=page,
        robot_mode=robot.mode if robot is not None else "",
        robot_phase=picture.phase,
        robot_version=picture.robot_version,
        robot_tasks=picture.robot_tasks,
        robot_stopped_by_fault=_stopped_by_fault(picture),
        holder=robot.holder if robot is not None else "",
        in_control=picture.in_control,
        only_watches=picture.wish is Wish.WATCH,
        why_not_in_control=sentence(picture.why_not_in_control),
        link=link.health,
        silent_s=None if math.isinf(link.silent_s) else link.silent_s + tick_age_s,
        age_s=None if link.age_s is None else link.age_s + tick_age_s,
        round_trip_s=link.round_trip_s,
        not_understood=picture.other_schema,
        relay=relay,
        relay_error=relay_error,
        waiting=console.owner.waiting,
        tick_age_s=tick_age_s,
    )


def _stopped_by_fault(picture: ConsoleState) -> bool:
    """Distinguish a stop by a guard from one by an operator, which names a site."""
    if picture.mode is not ControlMode.STOPPED:
        return False
    stop = next((notice for notice in reversed(picture.notices) if notice.what == EventKind.STOPPED), None)
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
