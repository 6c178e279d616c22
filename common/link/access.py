"""Access rules of a robot's port: the keys that each site may send and hear, by the name in its certificate."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from farhand.common.link.certificates import Role, read_rights
from farhand.common.wire import keys

_PATIENCE_US = 100_000
"""Longest wait of a robot for a listener with a full queue, before the listener is dropped [us]."""


def guarded(configuration: dict[str, Any], vehicle: str, listen: str, sites: str) -> dict[str, Any]:
    """Return the configuration of a robot with access rules, because anybody may connect to its port.

    A connected site may send on `op/SITE/*` and hear `rov/*`, and nothing else: no stranger can read the operators'
    messages, take their questions, or speak for the robot. A site that does not read delays others by at most
    `_PATIENCE_US` in all: a message that must arrive waits that long for room in the site's queue, then the site is
    dropped. The queue of a live site has room, because its messages first wait in the sockets' buffers.

    Args:
        configuration: The transport's configuration.
        vehicle: Name of the robot.
        listen: Endpoint of the robot.
        sites: File with the list of sites; empty: every connected site is an operator.

    Raises:
        InvalidConfiguration: When the list cannot be read or is malformed; names file and field.
    """
    queue = configuration["transport"]["link"]["tx"]["queue"]
    queue["congestion_control"] = {
        "drop": {"wait_before_drop": 1_000},
        "block": {"wait_before_close": _PATIENCE_US},
    }
    below = f"{vehicle}/"
    common = [
        _rule("all hear", "ingress", ["declare_subscriber"], [f"{below}rov/**"]),
        _rule("the robot speaks", "egress", ["put"], [f"{below}rov/**"]),
        _rule(
            "the robot answers",
            "egress",
            ["reply", "declare_subscriber", "declare_queryable"],
            [f"{below}op/**"],
        ),
    ]
    rules, subjects, policies = list(common), [], []
    for subject, role, site in _subjects(sites):
        own = _rules_of(role, site, below, listen.startswith("quic/"))
        rules += own
        subjects.append(subject)
        policies.append({"rules": [rule["id"] for rule in (*common, *own)], "subjects": [subject["id"]]})
    control = {"rules": rules, "subjects": subjects, "policies": policies}
    return configuration | {"access_control": {"enabled": True, "default_permission": "deny", **control}}


def _rules_of(role: Role, site: str, below: str, datagrams: bool) -> list[dict[str, Any]]:
    """Return the rules of one site beyond the common ones: to send, and to hear the answers to its copied questions."""
    channels = keys.OBSERVERS if role == "observer" else [c for c in keys.ALL if c.is_to_robot]
    rules = [_rule(f"{site} speaks", "ingress", ["put", "query"], [below + c.of(site) for c in channels])]
    if datagrams:
        answers = [below + keys.answers_for(site, "*")]
        rules += [
            _rule(f"{site} hears its answers", "ingress", ["declare_subscriber"], answers),
            _rule(f"{site} is answered", "egress", ["put"], answers),
        ]
    return rules


def _subjects(sites: str) -> list[tuple[dict[str, Any], Role, str]]:
    """Return subject, role and name of each site: those in the list by their certificates, without a list anybody."""
    if not sites:
        return [({"id": "anybody"}, "operator", "*")]
    rights = read_rights(Path(sites).expanduser())
    return [
        ({"id": name, "cert_common_names": [name]}, right.role, name)
        for name, right in rights.items()
        if right.revoked is None and right.role != "robot"
    ]


def _rule(name: str, flow: str, messages: list[str], where: list[str]) -> dict[str, Any]:
    return {"id": name, "permission": "allow", "flows": [flow], "messages": messages, "key_exprs": where}
