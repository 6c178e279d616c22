"""Addresses: the one parser of host:port and of the transport's endpoints, and what binding says."""

from __future__ import annotations

import errno
import os
import socket
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from farhand.common.address import (
    bind,
    endpoint_fault,
    free_port,
    listening_fault,
    parse_address,
    show_address,
    split_address,
)
from farhand.common.errors import FarhandError, InvalidConfiguration, LinkError, PortTaken

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize(
    ("text", "address"),
    [
        ("127.0.0.1:7448", ("127.0.0.1", 7448)),
        ("[::1]:7448", ("::1", 7448)),
        ("[fe80::1%eth0]:1", ("fe80::1%eth0", 1)),
        ("robot.local:0", ("robot.local", 0)),
    ],
)
def test_an_address_is_read_and_shown_alike(text, address):
    assert parse_address(text, "listen") == address
    assert show_address(address) == text


@pytest.mark.parametrize(
    "text",
    ["", ":1", "host", "host:", "::1:7448", "[::1]", "[::1]7448", "[::1:7448", "::1]:7448", "[host]:1", "a:b:1",
     "host:65536", "host:-1", "host:+1", "host:1_0", "host:\u0663", "host: 1", "ho st:1", "ho\nst:1", "host:99999999999999",
     "[[::1]]:1", "tcp/host:1"],
)  # fmt: skip
def test_what_is_no_address_is_refused_with_its_field_and_an_example(text):
    with pytest.raises(
        InvalidConfiguration, match=r"listen: HOST:PORT, such as 127.0.0.1:7448 or \[::1\]:7448"
    ):
        parse_address(text, "listen")


@given(st.text(max_size=40))
def test_any_text_is_read_or_refused_and_what_was_read_is_shown_alike(text: str):
    try:
        address = parse_address(text, "listen")
    except InvalidConfiguration:
        return
    assert parse_address(show_address(address), "listen") == address


@pytest.mark.parametrize(
    "endpoint", ["tcp/127.0.0.1:7447", "tls/[::1]:1", "quic/robot:7447?mixed_rel=1", "udp/a:1#iface=lo"]
)
def test_an_endpoint_of_the_transport_has_no_fault(endpoint):
    assert endpoint_fault(endpoint) == ""


@pytest.mark.parametrize(
    "endpoint",
    [
        "",
        "127.0.0.1:7447",
        "tcp/",
        "tcp/::1:7447",
        "tcp//127.0.0.1:1",
        "tpc/a:1",
        "tcp/a:99999",
        "tcp/a",
    ],
)
def test_what_is_no_endpoint_is_explained_with_an_example(endpoint):
    assert "such as tcp/127.0.0.1:7447 or tcp/[::1]:7447" in endpoint_fault(endpoint)
    assert endpoint_fault(endpoint).endswith(f"got {endpoint!r}")


@pytest.mark.parametrize("host", ["127.0.0.1", "::1"])
def test_a_port_in_use_is_said_for_every_kind_of_socket(host):
    with socket.create_server((host, 0), family=socket.AF_INET6 if ":" in host else socket.AF_INET) as taken:
        address = (host, taken.getsockname()[1])
        with pytest.raises(LinkError, match=f"port {address[1]} on {host} is in use: .* choose another port"):
            bind(address)
        assert "is in use" in listening_fault(f"tcp/{show_address(address)}")
        assert "is in use" in listening_fault(f"tls/{show_address(address)}")
        assert listening_fault(f"udp/{show_address(address)}") == ""
        assert "is in use" in listening_fault(f"quic/{show_address(address)}")  # TLS listens beside it


def test_a_datagram_port_in_use_is_said():
    with socket.socket(type=socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        assert "is in use" in listening_fault(f"quic/127.0.0.1:{taken.getsockname()[1]}")


@pytest.mark.parametrize("host", ["203.0.113.1", "no.such.host.invalid", "x" * 300, "a..b"])
def test_a_host_that_is_not_this_machine_is_one_clear_error(host):
    with pytest.raises(FarhandError, match=r"cannot listen on .*choose an address of this machine"):
        bind((host, 0))


def test_nobody_else_parses_addresses():
    """The parser is the only place that takes a text apart at its last colon."""
    found = {
        path.name
        for folder in ("common", "local_site", "remote_site", "deploy", "evaluation")
        for path in (ROOT / folder).rglob("*.py")
        if 'rpartition(":")' in path.read_text() or 'rsplit(":"' in path.read_text()
    }
    assert found <= {"address.py"}


@pytest.mark.parametrize(
    ("number", "words"),
    [
        (errno.EADDRINUSE, "port 80 on 127.0.0.1 is in use: end the process that holds it, or take --port"),
        (errno.EADDRNOTAVAIL, r"no interface of this machine has this IPv4 address now; .* such as ::1"),
        (errno.EACCES, r"this user may not .*; take --port, above 1023"),
        (errno.ENOBUFS, r"No buffer space available; choose an address of this machine and a free port"),
    ],
)
def test_what_keeps_a_port_from_being_opened_is_told_apart(number, words, monkeypatch):
    def refuse(*_: object) -> None:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(socket.socket, "bind", refuse)
    with pytest.raises(LinkError, match=words) as caught:
        bind(("127.0.0.1", 80), other_port="take --port")
    assert isinstance(caught.value, PortTaken) is (number == errno.EADDRINUSE)


@pytest.mark.parametrize("host", ["::1", "::"])
def test_an_ipv6_address_that_no_interface_has_is_told_with_one_of_ipv4(host, monkeypatch):
    def refuse(*_: object) -> None:
        raise OSError(errno.EADDRNOTAVAIL, os.strerror(errno.EADDRNOTAVAIL))

    monkeypatch.setattr(socket.socket, "bind", refuse)
    with pytest.raises(LinkError, match=r"this IPv6 address now; .* such as 127\.0\.0\.1"):
        bind((host, 0))


@pytest.mark.parametrize("scheme", ["tcp", "tls", "quic"])
def test_a_machine_without_an_ipv4_loopback_is_told_when_a_free_port_is_looked_for(scheme, monkeypatch):
    def refuse(*_: object) -> None:
        raise OSError(errno.EADDRNOTAVAIL, os.strerror(errno.EADDRNOTAVAIL))

    monkeypatch.setattr(socket.socket, "bind", refuse)
    with pytest.raises(
        LinkError, match=r"no interface of this machine has this IPv4 address now; .* such as ::1"
    ):
        free_port(scheme)


def test_every_address_takes_both_kinds_and_one_takes_its_own():
    with bind(("::", 0)) as both:
        port = both.getsockname()[1]
        socket.create_connection(("127.0.0.1", port)).close()
        socket.create_connection(("::1", port)).close()
    with bind(("::1", 0)) as one, pytest.raises(OSError):
        socket.create_connection(("127.0.0.1", one.getsockname()[1]))


@pytest.mark.parametrize(
    ("text", "found"),
    [("host", ("host", None)), ("host:80", ("host", 80)), ("[::1]", ("::1", None)), ("[::1]:80", ("::1", 80)),
     ("::1", None), ("[host]", None), ("host:", None), (":80", None), ("host:99999", None), ("", None), ("[]:1", None)],
)  # fmt: skip
def test_a_host_may_come_without_its_port(text, found):
    assert split_address(text) == found
