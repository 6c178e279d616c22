"""Hub: router on the shore side, to which robots and operators connect, so that the narrow link carries each message once.

Through a router a robot sees only the router's certificate. Therefore the hub binds the keys to the names in the
certificates: a robot speaks below its own name, a site on its own keys of the robots that it may reach. Robots and
operators are two regions of the transport's network; the hub carries messages between them, and none within one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import zenoh

from farhand.common.link.access import (
    AccessWatch,
    access_control,
    channels_of,
    drop_deaf_listeners,
    obeys_all,
    rule,
)
from farhand.common.link.certificates import Right, check_site_certificate, read_rights
from farhand.common.link.connection_faults import DeafListeners
from farhand.common.link.endpoint import (
    MOST_SESSIONS,
    OPERATORS,
    ROBOTS,
    EndpointSettings,
    bare_configuration,
)
from farhand.common.link.questions import in_reader, reply_to
from farhand.common.link.session import Session
from farhand.common.log import loop_logger
from farhand.common.names import user_path
from farhand.common.wire import keys

_log = loop_logger(__name__)

_ANY_ROBOT = "*/"
_MOST_SESSIONS = 4 * MOST_SESSIONS
"""Largest number of connections: over QUIC each site has two."""


_MOST_HZ = {keys.INPUT: 250.0, keys.HEARTBEAT: 250.0}
"""Largest rate of a site's replaceable messages, to all robots together [Hz]: a flood of them ends here, before a narrow link."""


@dataclass(frozen=True)
class Presence:
    """Sites at a hub.

    Args:
        robots: Names of the robots that are there.
        connections: Names in the certificates of the connected sites; their addresses without certificates.
    """

    robots: tuple[str, ...]
    connections: tuple[str, ...]


class Hub:
    """Router for robots and operators, with the rights of each by the name in its certificate.

    Args:
        settings: Endpoint to listen on, certificate and list of sites.

    Raises:
        InvalidConfiguration: When the list or the certificate is malformed; names file and field.
        LinkError: When the endpoint cannot be listened on.
    """

    def __init__(self, settings: EndpointSettings):
        if settings.certificates:
            check_site_certificate(settings.certificate_folder, _log.warning)
        self._access = None
        self._session = Session(settings, _configuration)
        self._deaf = DeafListeners(self._session.locators, settings.listen, _log.warning)
        if settings.certificates:
            self._access = AccessWatch(settings.certificate_folder, settings.sites, self._session.reopen)
        self._session.declare(self._tell_rights)

    def presence(self) -> Presence:
        """Return the sites that are connected now."""
        return Presence(self._session.robots(), tuple(sorted(set(self._session.peers()))))

    def tend(self) -> None:
        """Search for connections whose other end does not read; never blocks."""
        self._deaf.look()

    def close(self) -> None:
        """Close all connections."""
        for part in (self._access, self._deaf, self._session):
            if part is not None:
                part.close()

    def _tell_rights(self, session: zenoh.Session) -> Any:
        answers = self._access.answers() if self._access is not None else obeys_all

        def hear(query: zenoh.Query) -> None:
            reply_to(query, answers(str(query.key_expr).split("/")[2]))

        return session.declare_queryable(_ANY_ROBOT + keys.RIGHT.of("*"), in_reader(hear))


def _configuration(settings: EndpointSettings) -> dict[str, Any]:
    """Return the transport's configuration of a hub.

    Raises:
        InvalidConfiguration: When the list of sites cannot be read or is malformed; names file and field.
    """
    configuration = bare_configuration(settings) | {
        "mode": "router",
        "gateway": {"south": [{"filters": [{"region_names": [name]}]} for name in (ROBOTS, OPERATORS)]},
    }
    configuration["transport"]["unicast"]["max_sessions"] = _MOST_SESSIONS
    drop_deaf_listeners(configuration)
    # A robot behind a narrow link has no room for what one operator floods it with. Its sender repeats a message that is
    # dropped here; dropping the robot, as a listener that does not read, would take it from all its operators.
    configuration["qos"] = {
        "network": [
            {
                "id": "to robots",
                "flows": ["egress"],
                "messages": ["put", "query"],
                "key_exprs": [_ANY_ROBOT + "op/**"],
                "overwrite": {"congestion_control": "drop"},
            }
        ]
    }
    configuration["downsampling"] = [
        {
            "id": "streams",
            "flows": ["ingress"],
            "messages": ["put"],
            "rules": [
                {"key_expr": _ANY_ROBOT + channel.of("*"), "freq": hz} for channel, hz in _MOST_HZ.items()
            ],
        }
    ]
    if not settings.sites:
        return configuration
    return configuration | {"access_control": _access(read_rights(user_path(settings.sites, "sites")))}


def _access(rights: dict[str, Right]) -> dict[str, Any]:
    rights_key = [_ANY_ROBOT + keys.RIGHT.of("*")]
    common = [
        rule("anybody asks what it may do", "ingress", ["query"], rights_key),
        rule("the hub answers", "egress", ["reply", "declare_queryable"], rights_key),
    ]
    rules: list[dict[str, Any]] = [*common]
    subjects: list[dict[str, Any]] = [{"id": "whoever asks"}]
    policies = [{"rules": [each["id"] for each in common], "subjects": ["whoever asks"]}]
    for name, right in rights.items():
        if right.role == "robot" and right.revoked is None:
            own = _rules_of_robot(name)
        elif right.is_of_site:
            own = _rules_of_site(name, right)
        else:
            continue
        rules += own
        subjects.append({"id": name, "cert_common_names": [name]})
        policies.append({"rules": [each["id"] for each in own], "subjects": [name]})
    return access_control(rules, subjects, policies)


def _rules_of_robot(name: str) -> list[dict[str, Any]]:
    """Return the rules of a robot: it speaks below its own name, and hears what the operators send there."""
    told = [f"{name}/rov/**", f"{name}/{keys.answers_for('*', '*')}"]
    asked = [f"{name}/op/**"]
    return [
        rule(f"{name} speaks", "ingress", ["put"], told),
        rule(f"{name} serves", "ingress", ["reply", "declare_queryable", "declare_subscriber"], asked),
        rule(f"{name} is there", "ingress", ["liveliness_token"], [f"{name}/{keys.ALIVE}"]),
        rule(f"{name} hears", "egress", ["put", "query"], asked),
        rule(f"{name} is heard", "egress", ["declare_subscriber"], told),
    ]


def _rules_of_site(name: str, right: Right) -> list[dict[str, Any]]:
    """Return the rules of an operator's site: its own keys of the robots that it may reach."""
    robots = [f"{robot}/" for robot in right.robots] or [_ANY_ROBOT]

    def keys_of(*below: str) -> list[str]:
        return [robot + key for robot in robots for key in below]

    heard = keys_of("rov/**", keys.answers_for(name, "*"))
    tokens = keys_of(keys.ALIVE)
    found = ["liveliness_query", "declare_liveliness_subscriber"]
    speaks = keys_of(*(channel.of(name) for channel in channels_of(right.role)))
    return [
        rule(f"{name} speaks", "ingress", ["put", "query"], speaks),
        rule(f"{name} listens", "ingress", ["declare_subscriber"], heard),
        rule(f"{name} looks", "ingress", found, [_ANY_ROBOT + keys.ALIVE]),
        rule(f"{name} is told", "egress", ["put"], heard),
        rule(f"{name} is answered", "egress", ["reply"], keys_of(f"op/{name}/**")),
        rule(f"{name} is served", "egress", ["declare_queryable", "declare_subscriber"], keys_of("op/**")),
        rule(f"{name} finds", "egress", ["liveliness_token"], tokens),
    ]
