"""`farhand status --connect HUB`: the robots at a hub, and what each does."""

from __future__ import annotations

import json
import sys
from typing import Any

from farhand.common.errors import LinkError
from farhand.common.link.connection_faults import find_refusal
from farhand.common.link.endpoint import EndpointSettings
from farhand.common.link.fleet import Fleet, RobotAtHub, follow_until
from farhand.deploy.site_processes import configured
from farhand.deploy.status import HEALTHY, NOT_THERE

_HUB_S, _REPORTS_S = 5.0, 2.0
_OLD_S = 10.0


def run_hub_status(connect: str, certificates: str, as_json: bool) -> int:
    """Ask a hub which robots are there, and print them.

    Args:
        connect: Endpoint of the hub.
        certificates: Folder of the asking site's certificate; empty for none.
        as_json: Whether to print JSON.

    Returns:
        The exit status: 0 if a robot is there, 4 if none is.

    Raises:
        InvalidConfiguration: When the endpoint or the certificate is not in order.
        LinkError: When the hub does not answer.
    """
    settings = configured(EndpointSettings, None, connect=connect, certificates=certificates)
    fleet = Fleet(settings)
    try:
        if not follow_until(fleet, lambda: fleet.is_connected, _HUB_S):
            why = find_refusal(connect, settings.certificate_folder) if certificates else ""
            raise LinkError(f"no hub answers at {connect}: {why or 'is `farhand hub` running there?'}")
        follow_until(
            fleet,
            lambda: bool(fleet.states()) and all(s.is_there and s.report for s in fleet.states()),
            _REPORTS_S,
        )
        states = fleet.states()
    finally:
        fleet.close()
    if as_json:
        sys.stdout.write(json.dumps([_facts(state) for state in states], indent=2) + "\n")
    else:
        sys.stdout.writelines(f"{line}\n" for line in map(_line, states))
        if not states:
            sys.stdout.write(f"no robot is at {connect}, or this site may reach none\n")
    return HEALTHY if any(state.is_there for state in states) else NOT_THERE


def _line(state: RobotAtHub) -> str:
    report = state.report
    if report is None:
        return f"{state.name}: at the hub, no report yet"
    mode = f"{report.mode} {report.phase}".strip()
    age = f", last heard {state.age_s:.0f} s ago" if state.age_s > _OLD_S or not state.is_there else ""
    gone = "" if state.is_there else ", not at the hub any more"
    return f"{state.name}: {mode}, {report.holder or 'nobody'} in control{age}{gone}"


def _facts(state: RobotAtHub) -> dict[str, Any]:
    report = state.report
    return {
        "name": state.name, "is_there": state.is_there,
        "mode": str(report.mode) if report is not None else None,
        "phase": str(report.phase) if report is not None else None,
        "holder": report.holder if report is not None else None,
        "age_s": round(state.age_s, 3) if report is not None else None,
    }  # fmt: skip
