"""Who is let in over an encrypted link, and who is not: over real QUIC connections, with certificates of real authorities."""

from __future__ import annotations

import itertools
import re
import shutil
import time
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest

from farhand.common.address import free_port
from farhand.common.errors import InvalidConfiguration, LinkError
from farhand.common.link.access import explain_right
from farhand.common.link.endpoint import EndpointSettings
from farhand.common.link.interface import site_of
from farhand.common.link.link import ZenohLink
from farhand.common.wire import keys
from farhand.common.wire.reasons import Code
from farhand.deploy.pki.registry import Registry
from tests.common.link.encrypted import Heard, ask_until_answered, operator

HOST = "127.0.0.1"
PATIENCE_S = 60.0


def test_who_has_another_authority_or_dials_another_name_is_not_answered_and_the_right_one_is(
    tmp_path: Path, registry: Registry, robot, monkeypatch: pytest.MonkeyPatch
):
    _, port = robot
    stranger = Registry.create(tmp_path / "pki", "fleet").issue("shore-1", "operator", (), 30)
    strangers = [operator(stranger, port)]
    mixed = tmp_path / "mixed"  # trusts the robot, and shows a certificate that the robot does not trust
    shutil.copytree(stranger, mixed)
    ca = registry.folder_of("rov1") / "ca.pem"
    shutil.copy(ca, mixed / "ca.pem")
    with pytest.raises(InvalidConfiguration, match="issued by the authority"):
        operator(mixed, port)
    with monkeypatch.context() as patched:  # somebody who does not run Farhand leaves out such checks
        patched.setattr("farhand.common.link.link.check_site_certificate", lambda *_: None)
        strangers.append(operator(mixed, port))
    by_name = EndpointSettings(
        connect=f"quic/localhost:{port}", certificates=str(registry.folder_of("shore-1"))
    )
    strangers.append(ZenohLink(by_name))  # the robot's certificate has the address alone
    here = operator(registry.folder_of("shore-1"), port)
    try:
        assert ask_until_answered(here) == b"cba"
        for link in strangers:
            assert link.ask_and_wait(keys.LEASE, b"abc", 1.0) is None
    finally:
        for link in (*strangers, here):
            link.close()


def test_the_robot_is_told_the_name_in_the_certificate_of_who_sends(registry: Registry, robot):
    end, port = robot
    stops: list[str] = []
    end.subscribe(keys.STOP, lambda data: stops.append(site_of(data)))
    end.serve(keys.COMMAND, lambda request: request.answer(site_of(request.data).encode()))
    end.serve(keys.REPORT, lambda request: request.answer(site_of(request.data).encode()))
    here = operator(registry.folder_of("shore-1"), port)
    deadline_s = time.monotonic() + PATIENCE_S
    try:
        ask_until_answered(here)
        for channel in (keys.COMMAND, keys.REPORT):  # by copies, and by the transport's own question
            assert here.ask_and_wait(channel, b"?", PATIENCE_S) == b"shore-1"
        while not stops:
            assert time.monotonic() < deadline_s
            here.send(keys.STOP, b"stop")
            time.sleep(0.05)
        assert set(stops) == {"shore-1"}
    finally:
        here.close()


def test_an_operators_certificate_does_not_pass_for_a_robots(registry: Registry):
    port = free_port("quic")
    false = ZenohLink(
        EndpointSettings(listen=f"quic/{HOST}:{port}", certificates=str(registry.folder_of("shore-1")))
    )
    false.serve(keys.LEASE, lambda request: request.answer(b"I am the robot"))
    here = operator(registry.folder_of("shore-1"), port)
    try:
        for _ in range(20):
            assert here.ask_and_wait(keys.LEASE, b"abc", 0.1) is None
    finally:
        here.close()
        false.close()


def test_the_list_of_sites_says_who_commands_who_only_stops_and_who_is_refused(tmp_path: Path):
    registry = Registry.create(tmp_path / "pki", "fleet")
    registry.issue("rov1", "robot", (HOST,), 30)
    folders = {
        name: registry.issue(name, "observer" if name == "watcher" else "operator", (), 30)
        for name in ("shore-1", "watcher", "left")
    }
    unlisted = Registry.open(tmp_path / "pki")
    kept = (tmp_path / "pki" / "left-key").write_bytes((folders["left"] / "key.pem").read_bytes())
    assert kept
    registry.revoke("left")
    (folders["left"] / "key.pem").write_bytes(
        (tmp_path / "pki" / "left-key").read_bytes()
    )  # as the thief has it
    list_of_sites = tmp_path / "sites.json"
    shutil.copy(tmp_path / "pki" / "sites.json", list_of_sites)
    folders["unlisted"] = unlisted.issue("unlisted", "operator", (), 30)  # after the robot got its list
    port = free_port("quic")
    robot = ZenohLink(
        EndpointSettings(
            listen=f"quic/{HOST}:{port}",
            certificates=str(registry.folder_of("rov1")),
            sites=str(list_of_sites),
        )
    )
    for channel in (keys.COMMAND, keys.REPORT):
        robot.serve(channel, lambda request: request.answer(request.data))
    stops = Heard(robot, keys.STOP)
    links = {name: operator(folder, port) for name, folder in folders.items()}
    numbers = {name: k for k, name in enumerate(links, start=1)}
    try:
        for name, channel in (("shore-1", keys.COMMAND), ("shore-1", keys.REPORT), ("watcher", keys.REPORT)):
            while links[name].ask_and_wait(channel, b"?", PATIENCE_S) != b"?":
                pass
        for name in ("shore-1", "watcher"):
            while not stops.until(lambda items, name=name: numbers[name] in items, 0.05):
                links[name].send(keys.STOP, numbers[name].to_bytes(4, "big"))
        for name, channel in itertools.product(("left", "unlisted"), (keys.COMMAND, keys.REPORT)):
            assert links[name].ask_and_wait(channel, b"?", 0.5) is None
            links[name].send(keys.STOP, numbers[name].to_bytes(4, "big"))
        assert links["watcher"].ask_and_wait(keys.COMMAND, b"?", 0.5) is None
        assert links["shore-1"].ask_and_wait(keys.COMMAND, b"?", PATIENCE_S) == b"?"
        assert set(stops.items) == {numbers["shore-1"], numbers["watcher"]}
    finally:
        for link in (*links.values(), robot):
            link.close()


def test_a_site_with_an_expired_certificate_says_so_and_does_not_try(tmp_path: Path):
    then = datetime.now(UTC) - timedelta(days=100)
    folder = Registry.create(tmp_path / "pki", "fleet", then).issue("shore-1", "operator", (), 90, then)
    with pytest.raises(LinkError, match=r"certificate of shore-1 expired on .*: farhand pki renew shore-1"):
        operator(folder, free_port("quic"))


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"connect": "quic/127.0.0.1:1"}, r"certificates: the folder that `farhand pki` made"),
        ({"listen": "tls/127.0.0.1:1"}, r"certificates: the folder that `farhand pki` made"),
        (
            {"listen": "tcp/127.0.0.1:1", "sites": "x"},
            "sites: a list for a robot that listens with a certificate",
        ),
        ({"connect": "tcp/127.0.0.1:1", "certificates": "x"}, r"connect: quic/ or tls/ and HOST:PORT"),
    ],
)
def test_encryption_is_asked_for_wholly_or_not_at_all(fields: dict[str, Any], words: str):
    with pytest.raises(ValueError, match=words):
        EndpointSettings(**fields)


@pytest.mark.parametrize("field", ["listen", "connect"])
@pytest.mark.parametrize("where", ["0.0.0.0:7447", "[::]:7447", "10.0.0.5:7447", "rov1.example:7447"])
def test_a_plain_endpoint_of_other_machines_is_refused_unless_one_insists(field: str, where: str):
    endpoint = f"tcp/{where}"
    fields: dict[str, Any] = {field: endpoint}
    with pytest.raises(
        ValueError, match=rf"^{field}: a quic/ endpoint .*farhand pki.*--insecure.*got '"
    ) as caught:
        EndpointSettings(**fields)
    assert endpoint in str(caught.value)
    assert EndpointSettings(**fields, insecure=True).is_open


@pytest.mark.parametrize("where", ["127.0.0.1:7447", "localhost:7447", "[::1]:7447", "127.8.9.1:1"])
def test_a_plain_endpoint_of_this_machine_needs_no_insisting(where: str):
    assert not EndpointSettings(connect=f"tcp/{where}").is_open


def test_a_link_warns_while_it_is_not_encrypted_and_when_its_certificate_ends_within_a_fortnight(
    tmp_path: Path,
):
    registry = Registry.create(tmp_path / "pki", "fleet")
    registry.issue("later", "operator", (), 30)
    registry.issue("soon", "operator", (), 9)

    def warning(**settings: Any) -> str:
        link = ZenohLink(EndpointSettings(**settings))
        try:
            return link.warning()
        finally:
            link.close()

    assert warning(connect="tcp/203.0.113.1:1", insecure=True) == "NOT ENCRYPTED"
    assert warning(connect="tcp/127.0.0.1:1") == ""
    ends = {
        name: warning(connect="quic/127.0.0.1:1", certificates=str(registry.folder_of(name)))
        for name in ("later", "soon")
    }
    assert ends["later"] == ""
    assert re.fullmatch("the certificate of soon expires in [89] days: farhand pki renew soon", ends["soon"])


def test_a_folder_without_certificates_is_named(tmp_path: Path):
    with pytest.raises(InvalidConfiguration, match=r"certificate\.pem: a readable file"):
        operator(tmp_path, free_port("quic"))


def test_a_changed_list_takes_effect_in_place_and_each_site_is_told_what_it_may_do(tmp_path: Path):
    registry = Registry.create(tmp_path / "pki", "fleet")
    registry.issue("rov1", "robot", (HOST,), 30)
    names = ("shore-1", "watcher")
    issued = [registry.issue(n, "observer" if n == "watcher" else "operator", (), 30) for n in names]
    folders = [Path(shutil.copytree(folder, tmp_path / folder.name)) for folder in issued]  # each at its site
    list_of_sites = tmp_path / "pki" / "sites.json"
    port = free_port("quic")
    robot = ZenohLink(
        EndpointSettings(
            listen=f"quic/{HOST}:{port}",
            certificates=str(registry.folder_of("rov1")),
            sites=str(list_of_sites),
        )
    )
    robot.serve(keys.COMMAND, lambda request: request.answer(request.data))
    shore, watcher = (operator(folder, port) for folder in folders)

    def code(link: ZenohLink, name: str) -> str:
        while (answer := link.ask_and_wait(keys.RIGHT, b"", 2.0)) is None:
            pass
        why = explain_right(answer, name, "rov1")
        return why.code if why is not None else ""

    def until(holds: Callable[[], bool]) -> None:
        deadline_s = time.monotonic() + PATIENCE_S
        while not holds():
            assert time.monotonic() < deadline_s

    try:
        until(lambda: shore.ask_and_wait(keys.COMMAND, b"?", 1.0) == b"?")
        assert (code(shore, "shore-1"), code(watcher, "watcher")) == ("", Code.OBSERVER)
        registry.revoke("shore-1")
        until(lambda: code(shore, "shore-1") == Code.REVOKED)
        assert shore.ask_and_wait(keys.COMMAND, b"?", 1.0) is None
        rights = list_of_sites.read_bytes()
        list_of_sites.write_bytes(b"{ not a list")  # the robot goes on with the rights of before
        assert code(shore, "shore-1") == Code.REVOKED
        list_of_sites.write_bytes(rights.replace(b'"observer"', b'"operator"'))
        until(lambda: watcher.ask_and_wait(keys.COMMAND, b"?", 1.0) == b"?")
        assert code(watcher, "watcher") == ""
    finally:
        for link in (shore, watcher, robot):
            link.close()


@pytest.mark.parametrize(
    "answer", [b"", b'"\xff"', b'{"role": "\xff"}', b"[" * 100_000, b'{"role": "king"}', b"5", b'{"role": 5']
)
def test_a_robots_answer_about_rights_that_makes_no_sense_is_none(answer: bytes):
    assert explain_right(answer, "shore-1", "rov1") is None
