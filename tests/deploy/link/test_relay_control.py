"""The control socket of the link process, and the process, over real sockets."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import pytest

import farhand.deploy
from farhand.common.errors import InvalidConfiguration, LinkError
from farhand.common.impairment.impairment import DirectionSettings, LinkSettings
from farhand.common.impairment.link_control import RelayControl
from farhand.common.impairment.link_profile import load_profiles
from farhand.deploy.link.link_process import ControlServer
from farhand.deploy.link.relay import Relay

HOST = "127.0.0.1"
PROFILES = load_profiles(Path(farhand.deploy.__file__).with_name("link_profiles.toml"))
START = LinkSettings(
    uplink=DirectionSettings(delay_ms=300, jitter_ms=20), downlink=DirectionSettings(delay_ms=7)
)


def controlled(use: Callable[[RelayControl], None]) -> None:
    """Run `use` in a thread against a control server."""

    async def scenario() -> None:
        relay = Relay((HOST, 0), (HOST, 9), START)
        server = ControlServer(relay, PROFILES, (HOST, 0))
        async with asyncio.timeout(30):
            await relay.start()
            await server.start()
            try:
                await asyncio.to_thread(use, RelayControl(*server.address))
            finally:
                await server.stop()
                await relay.stop()
        assert asyncio.all_tasks() == {asyncio.current_task()}

    asyncio.run(scenario())


def say(control: RelayControl, *lines: bytes) -> list[Any]:
    """Send raw lines over one connection; the answers."""
    with socket.create_connection((control._host, control._port), 10) as sock, sock.makefile("rb") as answers:
        replies = []
        for line in lines:
            sock.sendall(line)
            replies.append(msgspec.json.decode(answers.readline()))
        return replies


def test_the_status_shows_the_settings_the_traffic_and_no_outage():
    def use(control: RelayControl) -> None:
        status = control.status()
        assert status["settings"] == msgspec.to_builtins(START)
        assert status["profile"] == "custom"
        assert status["outage"] == {"kind": "none", "remaining_s": 0.0}
        assert status["uplink"] == {
            "queued_bytes": 0,
            "delivered_bytes": 0,
            "swallowed_bytes": 0,
            "lateness_p50_ms": None,
            "lateness_p99_ms": None,
            "lateness_max_ms": None,
            "datagrams": dict.fromkeys(
                ("taken", "lost", "duplicated", "corrupted", "overflowed", "delivered"), 0
            ),
        }

    controlled(use)


def test_a_profile_replaces_both_directions():
    def use(control: RelayControl) -> None:
        status = control.profile("acoustic")
        assert status["profile"] == "acoustic"
        assert status["settings"] == msgspec.to_builtins(PROFILES["acoustic"].settings)
        spike = msgspec.to_builtins(PROFILES["leo"].over_time().at(0.0))
        assert control.profile("leo")["settings"] == spike  # its timeline begins at once
        control.profile("acoustic")
        with pytest.raises(InvalidConfiguration, match="one of lan, geo, leo, acoustic, not 'mars'"):
            control.profile("mars")
        assert control.status()["profile"] == "acoustic"

    controlled(use)


def test_a_set_replaces_only_the_fields_it_names():
    def use(control: RelayControl) -> None:
        settings = control.set(uplink={"delay_ms": 500}, downlink={"rate_bps": 9600})["settings"]
        assert settings["uplink"] == msgspec.to_builtins(DirectionSettings(delay_ms=500, jitter_ms=20))
        assert settings["downlink"] == msgspec.to_builtins(DirectionSettings(delay_ms=7, rate_bps=9600))

    controlled(use)


@pytest.mark.parametrize(
    ("downlink", "says"),
    [
        ({"delay_ms": -1}, "downlink: delay_ms must be a finite number"),
        ({"jitter_ms": 8}, r"downlink: jitter_ms \(8.*must not exceed delay_ms"),
        ({"speed": 0.1}, "downlink: .*unknown field `speed`.*delay_ms, jitter_ms"),
        ({"loss": 0.1, "gemodel_p": 1}, "downlink: loss and gemodel_p are two models of the same thing"),
        ({"rate_bps": "fast"}, "downlink.rate_bps: Expected `float`"),
        ({"distribution": "cauchy"}, "downlink.distribution: .*cauchy"),
    ],
)
def test_a_set_with_one_wrong_field_changes_nothing_at_all(downlink, says):
    def use(control: RelayControl) -> None:
        with pytest.raises(InvalidConfiguration, match=says):
            control.set(uplink={"delay_ms": 999}, downlink=downlink)
        assert control.status()["settings"] == msgspec.to_builtins(START)

    controlled(use)


def test_an_outage_begins_and_is_cleared():
    def use(control: RelayControl) -> None:
        outage = control.outage("stall", 3600)["outage"]
        assert outage["kind"] == "stall"
        assert 0 < outage["remaining_s"] <= 3600
        with pytest.raises(InvalidConfiguration, match="duration_s"):
            control.outage("reset", -1)
        assert control.status()["outage"]["kind"] == "stall"
        assert control.clear()["outage"]["kind"] == "none"
        assert control.clear()["outage"]["kind"] == "none"

    controlled(use)


@pytest.mark.parametrize(
    ("line", "field", "says"),
    [
        (b"{}\n", "", "request"),
        (b'{"request": "explode"}\n', "request", "explode"),
        (b'{"request": "status", "please": 1}\n', "", "please"),
        (b'{"request": "set", "sideways": {}}\n', "", "sideways"),
        (b'{"request": "set", "uplink": 3}\n', "uplink", "Expected `object`"),
        (b'{"request": "outage", "kind": "nap", "duration_s": 1}\n', "kind", "nap"),
    ],
)
def test_a_malformed_request_is_refused_by_field_and_the_next_one_answered(line, field, says):
    def use(control: RelayControl) -> None:
        refused, answered = say(control, line, b'{"request": "status"}\n')
        assert refused["error"]["field"] == field
        assert says in refused["error"]["expected"]
        assert answered["status"]["settings"] == msgspec.to_builtins(START)

    controlled(use)


OBEYED = b'{"request": "outage", "kind": "blackhole", "duration_s": 3600}\n'
FORM = b"POST / HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: text/plain\r\n\r\n"


@pytest.mark.parametrize(
    ("lines", "says"),
    [
        (FORM + OBEYED, "JSON"),
        (b"GET /?" + OBEYED, "JSON"),
        (b"\r\n" + OBEYED, "JSON"),
        (b"status\n" + OBEYED, "JSON"),
        (b"\xff\xfe\n" + OBEYED, "JSON"),
        (b'{"request": "\xff"}\n' + OBEYED, "JSON"),
        (b"[]\n" + OBEYED, "object"),
        (b"5\n" + OBEYED, "object"),
        (b"[" * 60_000 + b"\n" + OBEYED, "JSON"),
        (b'{"request": "outage", "kind": "stall", "duration_s": NaN}\n' + OBEYED, "JSON"),
        (b"x" * 200_000 + b"\n" + OBEYED, "at most 65536 bytes"),
        (b"x" * 200_000, "at most 65536 bytes"),
    ],
)
def test_after_a_line_of_another_protocol_nothing_is_obeyed(lines, says):
    """What a foreign web page can have a browser send is such a line first, whatever follows."""

    def use(control: RelayControl) -> None:
        with socket.create_connection((control._host, control._port), 10) as sock:
            sock.sendall(lines)
            with sock.makefile("rb") as answers:
                refused, *more = answers.read().splitlines()
        assert says in msgspec.json.decode(refused)["error"]["expected"]
        assert not more
        assert control.status()["outage"]["kind"] == "none"

    controlled(use)


def test_stopping_does_not_wait_for_an_idle_client():
    idle: list[socket.socket] = []

    def use(control: RelayControl) -> None:
        idle.append(socket.create_connection((control._host, control._port), 10))
        idle[0].sendall(b'{"request": "status"}\n')
        assert idle[0].recv(10)

    controlled(use)
    idle[0].close()


def test_nobody_there_is_one_clear_error():
    with socket.socket() as taken:
        taken.bind((HOST, 0))  # bound, not listening: a connection is refused
        port = taken.getsockname()[1]
        with pytest.raises(LinkError, match=rf"does not answer at 127.0.0.1:{port} .*is it running"):
            RelayControl(HOST, port).status()


def test_silence_is_one_clear_error():
    with (
        socket.create_server((HOST, 0)) as silent,
        pytest.raises(LinkError, match="no answer in time"),
    ):
        RelayControl(HOST, silent.getsockname()[1], timeout_s=0.05).status()


def test_what_is_not_a_link_process_is_told_apart():
    async def scenario() -> None:
        async def greet(_: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            writer.write(b"220 welcome\n")
            writer.close()
            await writer.wait_closed()

        other = await asyncio.start_server(greet, HOST, 0)
        async with other:
            control = RelayControl(HOST, other.sockets[0].getsockname()[1])
            with pytest.raises(LinkError, match="is not a link process"):
                await asyncio.to_thread(control.status)

    asyncio.run(scenario())


def test_a_control_port_in_use_is_one_clear_error():
    async def scenario() -> None:
        with socket.create_server((HOST, 0)) as taken:
            port = taken.getsockname()[1]
            server = ControlServer(Relay((HOST, 0), (HOST, 9), START), PROFILES, (HOST, port))
            with pytest.raises(LinkError, match=f"port {port} on 127.0.0.1 is in use"):
                await server.start()

    asyncio.run(scenario())
