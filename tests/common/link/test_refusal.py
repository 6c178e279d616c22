"""Each bad certificate is told by its reason, against real robots' ends of the transport."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from farhand.common.address import free_port
from farhand.common.link.connection_faults import explain_silence, find_refusal
from farhand.common.link.endpoint import EndpointSettings
from farhand.common.link.link import ZenohLink
from farhand.deploy.pki.registry import Registry

HOST = "127.0.0.1"
DAY = timedelta(days=1)


@contextmanager
def robot_with(folder: Path, monkeypatch: pytest.MonkeyPatch, sites: str = "") -> Iterator[str]:
    """A robot's end that does not look at its own certificate, and its endpoint."""
    monkeypatch.setattr("farhand.common.link.link.check_site_certificate", lambda *_: None)
    endpoint = f"quic/{HOST}:{free_port('quic')}"
    link = ZenohLink(EndpointSettings(listen=endpoint, certificates=str(folder), sites=sites))
    try:
        yield endpoint
    finally:
        link.close()


def test_a_site_is_told_what_the_robot_has_against_its_certificate(
    tmp_path: Path, registry: Registry, monkeypatch: pytest.MonkeyPatch
):
    now = datetime.now(UTC)
    late = registry.issue("late", "operator", (), 2, now - 5 * DAY)
    early = registry.issue("early", "operator", (), 2, now + 5 * DAY)
    other = Registry.create(tmp_path / "other", "fleet").issue("shore-1", "operator", (), 30)
    disguised = tmp_path / "disguised"
    shutil.copytree(other, disguised)
    shutil.copy(registry.folder_of("rov1") / "ca.pem", disguised / "ca.pem")
    with robot_with(registry.folder_of("rov1"), monkeypatch) as endpoint:
        assert find_refusal(endpoint, registry.folder_of("shore-1")) == ""
        for folder, words in (
            (other, "another authority has issued the robot's certificate"),
            (disguised, "another authority has issued this site's certificate than the robot trusts"),
            (late, "the robot takes this site's certificate for expired"),
            (early, "the robot takes this site's certificate for expired"),
        ):
            assert find_refusal(endpoint, folder).startswith(words)
        by_name = endpoint.replace(HOST, "localhost")
        assert "not for localhost" in find_refusal(by_name, registry.folder_of("shore-1"))


def test_a_site_is_told_what_is_wrong_with_the_robots_certificate(
    registry: Registry, monkeypatch: pytest.MonkeyPatch
):
    now = datetime.now(UTC)
    expired = registry.issue("rov-late", "robot", (HOST,), 2, now - 5 * DAY)
    early = registry.issue("rov-early", "robot", (HOST,), 2, now + 5 * DAY)
    mine = registry.folder_of("shore-1")
    for folder, words in (
        (expired, "the robot's certificate has expired"),
        (early, "the robot's certificate is not valid yet"),
        (mine, "shows the certificate of an operator, not of a robot"),
    ):
        with robot_with(folder, monkeypatch) as endpoint:
            assert words in find_refusal(endpoint, mine)


def test_a_robot_without_certificates_and_none_at_all_are_told_apart(registry: Registry):
    mine, port = registry.folder_of("shore-1"), free_port()
    assert "nobody listens at" in find_refusal(f"quic/{HOST}:{port}", mine)
    plain = ZenohLink(EndpointSettings(listen=f"tcp/{HOST}:{port}"))
    try:
        assert "does not speak TLS" in find_refusal(f"quic/{HOST}:{port}", mine)
    finally:
        plain.close()


def test_a_site_that_is_let_in_and_hears_nothing_is_told_of_the_list(
    tmp_path: Path, registry: Registry, monkeypatch: pytest.MonkeyPatch
):
    list_of_sites = tmp_path / "sites.json"
    list_of_sites.write_text('{"somebody-else": {"role": "operator"}}')
    with robot_with(registry.folder_of("rov1"), monkeypatch, str(list_of_sites)) as endpoint:
        mine = EndpointSettings(connect=endpoint, certificates=str(registry.folder_of("shore-1")))
        here = ZenohLink(mine)
        try:
            while not here.connected_to():
                pass
            why = explain_silence(mine, bool(here.connected_to()))
            assert "does its list of sites name shore-1, and not as revoked?" in why
            assert "accepts this site's certificate" in explain_silence(mine, False)
        finally:
            here.close()


def test_a_robot_that_listens_for_quic_answers_over_tcp_where_udp_is_blocked(registry: Registry, robot):
    _, port = robot
    here = ZenohLink(
        EndpointSettings(connect=f"tls/{HOST}:{port}", certificates=str(registry.folder_of("shore-1")))
    )
    try:
        while not here.connected_to():
            pass
        assert here.connected_to()[0].startswith("tls/")
    finally:
        here.close()
