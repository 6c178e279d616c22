"""Access rules of a robot's port: the keys that each site may send and hear, by the name in its certificate.

The transport reads certificates and rights when it opens. `AccessWatch` reopens it in place when one of the files has
changed, and tells every site its right: the transport itself denies without an answer.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec

from farhand.common.errors import FarhandError, InvalidMessage
from farhand.common.link.certificates import (
    CA_FILE,
    CERTIFICATE_FILE,
    KEY_FILE,
    Right,
    Role,
    SiteCertificate,
    read_certificate,
    read_rights,
    shown,
)
from farhand.common.log import loop_logger
from farhand.common.names import user_path
from farhand.common.whole_file import fault_of
from farhand.common.wire import keys
from farhand.common.wire.reasons import Code, Reason, because

_log = loop_logger(__name__)

_LOOK_S = 0.25

_PATIENCE_US = 100_000
"""Longest wait of a robot for a listener with a full queue, before the listener is dropped [us]."""


def with_access_rules(configuration: dict[str, Any], vehicle: str, listen: str, sites: str) -> dict[str, Any]:
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
    drop_deaf_listeners(configuration)
    below = f"{vehicle}/"
    answers = rule(
        "the robot answers", "egress", ["reply", "declare_subscriber", "declare_queryable"], [f"{below}op/**"]
    )
    common = [
        answers,
        rule("all hear", "ingress", ["declare_subscriber"], [f"{below}rov/**"]),
        rule("the robot speaks", "egress", ["put"], [f"{below}rov/**"]),
    ]
    asks = rule("anybody asks what it may do", "ingress", ["query"], [below + keys.RIGHT.of("*")])
    rules, subjects = [*common, asks], [{"id": "whoever asks"}]
    policies = [{"rules": [asks["id"], answers["id"]], "subjects": ["whoever asks"]}]
    for subject, role, site in _subjects(sites, vehicle):
        own = _rules_of(role, site, below, listen.startswith("quic/"))
        rules += own
        subjects.append(subject)
        policies.append({"rules": [rule["id"] for rule in (*common, *own)], "subjects": [subject["id"]]})
    return configuration | {"access_control": access_control(rules, subjects, policies)}


def drop_deaf_listeners(configuration: dict[str, Any]) -> None:
    """Have the transport drop a listener that does not read, before it delays the others by more than `_PATIENCE_US`."""
    configuration["transport"]["link"]["tx"]["queue"]["congestion_control"] = {
        "drop": {"wait_before_drop": 1_000},
        "block": {"wait_before_close": _PATIENCE_US},
    }


def access_control(
    rules: list[dict[str, Any]], subjects: list[dict[str, Any]], policies: list[dict[str, Any]]
) -> dict[str, Any]:
    """Return the transport's access control, which denies all that no rule allows."""
    control = {"rules": rules, "subjects": subjects, "policies": policies}
    return {"enabled": True, "default_permission": "deny", **control}


def _rules_of(role: Role, site: str, below: str, datagrams: bool) -> list[dict[str, Any]]:
    """Return the rules of one site beyond the common ones: to send, and to hear the answers to its copied questions."""
    speaks = [below + channel.of(site) for channel in channels_of(role)]
    rules = [rule(f"{site} speaks", "ingress", ["put", "query"], speaks)]
    if datagrams:
        answers = [below + keys.answers_for(site, "*")]
        rules += [
            rule(f"{site} hears its answers", "ingress", ["declare_subscriber"], answers),
            rule(f"{site} is answered", "egress", ["put"], answers),
        ]
    return rules


def channels_of(role: Role) -> list[keys.Channel]:
    """Return the channels on which a site of a role may send."""
    return list(keys.OBSERVERS) if role == "observer" else [c for c in keys.ALL if c.is_to_robot]


def _subjects(sites: str, vehicle: str) -> list[tuple[dict[str, Any], Role, str]]:
    """Return subject, role and name of each site: those in the list by their certificates, without a list anybody."""
    if not sites:
        return [({"id": "anybody"}, "operator", "*")]
    rights = read_rights(user_path(sites, "sites"))
    return [
        ({"id": name, "cert_common_names": [name]}, right.role, name)
        for name, right in rights.items()
        if right.is_of_site and right.reaches(vehicle)
    ]


def rule(name: str, flow: str, messages: list[str], where: list[str]) -> dict[str, Any]:
    """Return a rule that allows messages of some keys in one direction."""
    return {"id": name, "permission": "allow", "flows": [flow], "messages": messages, "key_exprs": where}


class AccessWatch:
    """Observer of a site's certificate and, at a robot, of its list of sites, in a thread of its own.

    Args:
        folder: Folder of the certificate.
        sites: List of sites; empty: every site is an operator.
        changed: Called when a file has changed and all of them are in order; may take a moment.
        look: Called four times a second, to look after something else.
    """

    def __init__(
        self, folder: Path, sites: str, changed: Callable[[], None], look: Callable[[], None] = lambda: None
    ):
        self._look = look
        self._folder, self._sites, self._changed = (
            folder,
            user_path(sites, "sites") if sites else None,
            changed,
        )
        self._rights = read_rights(self._sites) if self._sites else None
        self._certificate = SiteCertificate(folder, read_certificate(folder / CERTIFICATE_FILE))
        self._seen = self._state()
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._run, name="access", daemon=True)
        self._thread.start()

    def answers(self) -> Callable[[str], bytes]:
        """Return a function that tells a site its right as of now, as JSON: a `Right`, or null if it is not in the list.

        Each session takes its own, so that no site is told of a right before the transport enforces it.
        """
        rights = self._rights
        return obeys_all if rights is None else lambda site: msgspec.json.encode(rights.get(site))

    def warning(self) -> str:
        """Return a warning of the certificate's end, near or past; empty while that is far away."""
        return self._certificate.fault() or self._certificate.warning()

    def close(self) -> None:
        """End the thread."""
        self._closed.set()
        self._thread.join(timeout=5.0)

    def _run(self) -> None:
        while not self._closed.wait(_LOOK_S):
            self._look()
            if (state := self._state()) == self._seen:
                continue
            self._seen = state
            try:
                self._check()
            except FarhandError as error:
                _log.warning("the link goes on with the certificate and the rights of before: %s", error)
                continue
            _log.info("certificate or list of sites has changed: the link is opened again with it")
            self._changed()

    def _check(self) -> None:
        """Read all files.

        Raises:
            FarhandError: When one is not in order; the rights stay as they were.
        """
        certificate = SiteCertificate.load(self._folder)
        if fault := certificate.fault():
            raise FarhandError(fault)
        self._rights = read_rights(self._sites) if self._sites else None
        self._certificate = certificate

    def _state(self) -> list[tuple[int, int, int] | None]:
        files = [self._folder / name for name in (CA_FILE, CERTIFICATE_FILE, KEY_FILE)]
        return [_version(file) for file in [*files, *([self._sites] if self._sites else [])]]


def obeys_all(site: str) -> bytes:
    """Return the right of any site, as JSON, of a robot or hub without a list of sites."""
    del site
    return msgspec.json.encode(Right(role="operator"))


def _version(file: Path) -> tuple[int, int, int] | None:
    try:
        found = file.stat()
    except OSError:
        return None
    return found.st_ino, found.st_mtime_ns, found.st_size


def explain_right(answer: bytes, site: str, robot: str) -> Reason | None:
    """Return why a site may not command, as the robot has answered; None when it may, or the answer makes no sense.

    Args:
        answer: The answer of the robot, or of its hub, on `keys.RIGHT`.
        site: Name of the site.
        robot: Name of the robot.
    """
    try:
        with fault_of("right", InvalidMessage, "a right"):
            right = msgspec.json.decode(answer, type=Right | None)
    except InvalidMessage:
        return None
    if right is None or right.role in ("robot", "hub"):
        return because(Code.UNLISTED, site=site)
    if right.revoked is not None:
        return because(Code.REVOKED, site=site, text=shown(right.revoked))
    if not right.reaches(robot):
        return because(Code.OTHER_ROBOT, site=site, text=robot)
    return because(Code.OBSERVER, site=site) if right.role == "observer" else None
