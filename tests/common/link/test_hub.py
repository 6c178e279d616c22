"""Through a hub each robot hears its own operators alone, and each site what it may: real sessions over real sockets."""

from __future__ import annotations

import itertools
import shutil
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing
from pathlib import Path

import pytest

from farhand.common.address import free_port, listening_fault
from farhand.common.impairment.impairment import DirectionSettings, LinkSettings
from farhand.common.link.access import explain_right
from farhand.common.link.endpoint import EVERY_SITE, EndpointSettings
from farhand.common.link.fleet import Fleet
from farhand.common.link.hub import Hub
from farhand.common.link.hub import _configuration as hub_configuration
from farhand.common.link.link import ZenohLink
from farhand.common.mode_table import ControlMode
from farhand.common.wire import keys
from farhand.common.wire.codec import encode
from farhand.common.wire.messages import Stamp, Telemetry
from farhand.common.wire.reasons import Code
from farhand.deploy.pki.registry import Registry
from tests.common.link.encrypted import HOST, PATIENCE_S, Heard, RelayThread

ROBOTS = ("rov1", "rov2")
OPERATORS = ("shore-1", "shore-2")


class Sites:
    """A hub with robots and operators, each with a certificate of the same authority."""

    def __init__(self, folder: Path, scheme: str):
        self._stack = ExitStack()
        self._folder_of_all = folder
        self.scheme, self.port = scheme, free_port(scheme)
        self.registry = None
        if scheme != "tcp":
            self.registry = registry = Registry.create(folder / "pki", "fleet")
            registry.issue("hub", "hub", (HOST,), 30)
            for robot in ROBOTS:
                registry.issue(robot, "robot", (), 30)
            for name in OPERATORS:
                registry.issue(name, "operator", (), 30)
            registry.issue("watcher", "observer", (), 30)
            registry.issue("half", "operator", (), 30, robots=("rov2",))
        self._sites = str(folder / "pki" / "sites.json") if self.registry else ""
        self.hub = self.open_hub()
        self.robots = {name: self.link(name, EVERY_SITE, name) for name in ROBOTS}

    def __enter__(self) -> Sites:
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def open_hub(self) -> Hub:
        where = f"{self.scheme}/{HOST}:{self.port}"
        settings = EndpointSettings(listen=where, certificates=self.folder("hub"), sites=self._sites)
        return self._stack.enter_context(closing(Hub(settings)))

    def link(self, vehicle: str, site: str, certified: str) -> ZenohLink:
        where = f"{self.scheme}/{HOST}:{self.port}"
        settings = EndpointSettings(
            connect=where, vehicle=vehicle, site=site, certificates=self.folder(certified)
        )
        return self._stack.enter_context(closing(ZenohLink(settings)))

    def operator(self, vehicle: str, site: str) -> ZenohLink:
        return self.link(vehicle, site, site)

    def folder(self, name: str) -> str:
        """Return a copy of a site's folder, which stays when its name is revoked."""
        if self.registry is None:
            return ""
        copy = self._folder_of_all / name
        if not copy.exists():
            shutil.copytree(self.registry.folder_of(name), copy)
        return str(copy)


@pytest.fixture(params=["tcp", "quic"])
def fleet(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Sites]:
    with Sites(tmp_path, request.param) as fleet:
        yield fleet


@pytest.fixture
def encrypted(tmp_path: Path) -> Iterator[Sites]:
    with Sites(tmp_path, "quic") as fleet:
        yield fleet


def answer_by_name(fleet: Sites) -> None:
    for name, link in fleet.robots.items():
        link.serve(keys.COMMAND, lambda request, name=name: request.answer(name.encode() + request.data))


def until_answered(link: ZenohLink, channel: keys.Channel, data: bytes) -> bytes:
    """Ask until the answer comes: a site that is not connected yet is answered by nothing."""
    for _ in range(200):
        if (answer := link.ask_and_wait(channel, data, PATIENCE_S)) is not None:
            return answer
        threading.Event().wait(0.05)
    raise AssertionError("no answer")


def send_until(holds: Callable[[], bool], send: Callable[[], None]) -> None:
    for _ in range(1000):
        send()
        threading.Event().wait(0.02)
        if holds():
            return
    raise AssertionError("it never arrived")


def test_every_robot_hears_its_own_operators_alone_and_every_operator_its_own_robot(fleet: Sites):
    answer_by_name(fleet)
    places = list(itertools.product(ROBOTS, OPERATORS))
    links = {place: fleet.operator(*place) for place in places}
    hand = {name: Heard(link, keys.INPUT) for name, link in fleet.robots.items()}
    reports = {place: Heard(link, keys.TELEMETRY) for place, link in links.items()}
    for (robot, operator), link in links.items():
        assert until_answered(link, keys.COMMAND, operator.encode()) == (robot + operator).encode()
    for k, ((robot, _), link) in enumerate(links.items()):
        number = k.to_bytes(4, "big")
        send_until(
            lambda robot=robot, k=k: k in hand[robot].items,
            lambda link=link, number=number: link.send(keys.INPUT, number),
        )
    for k, (name, link) in enumerate(fleet.robots.items()):
        number = k.to_bytes(4, "big")
        heard = [reports[place] for place in places if place[0] == name]
        send_until(
            lambda heard=heard, k=k: all(k in each.items for each in heard),
            lambda link=link, number=number: link.send(keys.TELEMETRY, number),
        )
    for name, heard in hand.items():
        assert set(heard.items) == {k for k, place in enumerate(places) if place[0] == name}
    for (robot, _), heard in reports.items():
        assert set(heard.items) == {ROBOTS.index(robot)}


def test_the_robots_that_are_there_are_found_and_those_that_left_are_not(fleet: Sites):
    wait_until(lambda: fleet.hub.presence().robots == ROBOTS)
    fleet.robots["rov1"].close()
    wait_until(lambda: fleet.hub.presence().robots == ("rov2",))


def report(seq: int, mode: ControlMode) -> bytes:
    return encode(
        Telemetry(
            seq=seq, stamp=Stamp("boot", seq), mode=mode, position_m=(0.0, 0.0), frame_origin_m=(0.0, 0.0)
        )
    )


def test_the_fleet_shows_the_newest_report_of_each_robot_that_a_site_may_reach(encrypted: Sites):
    half = EndpointSettings(
        connect=f"quic/{HOST}:{encrypted.port}", certificates=encrypted.folder("half"), site="half"
    )

    def report_all() -> None:
        for link, mode in zip(encrypted.robots.values(), ControlMode, strict=False):
            link.send(keys.TELEMETRY, report(1, mode))

    with closing(Fleet(half)) as found, closing(Fleet(half, ("rov1", "rov2", "rov3"))) as named:
        send_until(
            lambda: any(state.report is not None and state.is_there for state in named.states()),
            report_all,
        )
        found.look()
        assert [state.name for state in found.states()] == ["rov2"]
        states = {state.name: state for state in named.states()}
        assert states["rov2"].report is not None and states["rov2"].report.mode is list(ControlMode)[1]
        assert states["rov1"].report is None and not states["rov1"].is_there
        assert states["rov3"].report is None and not states["rov3"].is_there


def test_all_are_back_after_the_hub_was_restarted(fleet: Sites):
    answer_by_name(fleet)
    operator = fleet.operator("rov1", "shore-1")
    assert until_answered(operator, keys.COMMAND, b"1") == b"rov11"
    fleet.hub.close()
    assert operator.ask_and_wait(keys.COMMAND, b"2", 0.5) is None
    wait_until(lambda: not listening_fault(f"{fleet.scheme}/{HOST}:{fleet.port}"))
    fleet.open_hub()
    assert until_answered(operator, keys.COMMAND, b"3") == b"rov13"


def test_a_site_does_what_the_list_of_the_hub_allows_it(encrypted: Sites):
    answer_by_name(encrypted)
    for name, link in encrypted.robots.items():
        link.serve(keys.REPORT, lambda request, name=name: request.answer(name.encode()))
    watcher, half = encrypted.operator("rov1", "watcher"), encrypted.operator("rov2", "half")
    wrong, shore = encrypted.operator("rov1", "half"), encrypted.operator("rov1", "shore-1")
    assert until_answered(watcher, keys.REPORT, b"") == b"rov1"
    assert until_answered(half, keys.COMMAND, b"!") == b"rov2!"
    assert until_answered(shore, keys.COMMAND, b"!") == b"rov1!"
    assert watcher.ask_and_wait(keys.COMMAND, b"!", 0.5) is None
    assert wrong.ask_and_wait(keys.COMMAND, b"!", 0.5) is None
    assert wrong.ask_and_wait(keys.REPORT, b"", 0.5) is None

    def why(link: ZenohLink, site: str, robot: str) -> str | None:
        reason = explain_right(until_answered(link, keys.RIGHT, b""), site, robot)
        return reason.code if reason is not None else None

    assert why(watcher, "watcher", "rov1") == Code.OBSERVER
    assert why(wrong, "half", "rov1") == Code.OTHER_ROBOT
    assert why(half, "half", "rov2") is None
    stops = Heard(encrypted.robots["rov1"], keys.STOP)
    send_until(
        lambda: 7 in stops.items, lambda: watcher.send(keys.STOP, (7).to_bytes(4, "big"))
    )  # an observer may stop


def test_a_flood_of_one_operator_ends_at_the_hub_and_does_not_slow_down_another_one(fleet: Sites):
    robot = fleet.robots["rov1"]
    answer_by_name(fleet)
    hand, stops, arrived = Heard(robot, keys.INPUT), Heard(robot, keys.STOP), threading.Event()

    def take(data: bytes) -> bool:
        if data == b"other":
            arrived.set()
        return data == b"other"

    robot.subscribe(keys.TARGET, take)
    flooder, other = (fleet.operator("rov1", name) for name in OPERATORS)
    for link in (flooder, other):
        assert until_answered(link, keys.COMMAND, b"") == b"rov1"
    began_s, n = time.monotonic(), 3000
    for _ in range(n):
        flooder._put(keys.INPUT, b"0000", False, None)
        flooder._put(keys.TARGET, b"unwanted", True, None)
    other_s = time.monotonic()
    # Sent again: the hub drops what a robot has no room for while its processor is late.
    send_until(arrived.is_set, lambda: other.send(keys.TARGET, b"other"))
    send_until(lambda: 7 in stops.items, lambda: other.send(keys.STOP, (7).to_bytes(4, "big")))
    # A pause of 2 ms for each unwanted message, as on a connection of its own, would make this six seconds.
    assert time.monotonic() - other_s < 5.0
    assert len(hand.items) <= 250.0 * (time.monotonic() - began_s) + 10 < n


def test_a_robot_behind_a_narrow_link_is_not_dropped_because_of_a_flood_of_one_operator(encrypted: Sites):
    narrow = DirectionSettings(delay_ms=20.0, rate_bps=60_000.0)
    relay = RelayThread(encrypted.port, LinkSettings(uplink=narrow, downlink=narrow))
    encrypted.port, hub_port = relay.port, encrypted.port
    robot = encrypted.link("rov2", EVERY_SITE, "rov2")
    robot.serve(keys.COMMAND, lambda request: request.answer(b"narrow"))
    robot.subscribe(keys.MODEL, lambda _: None)
    encrypted.robots["rov2"].close()
    encrypted.port = hub_port
    flooder, other = (encrypted.operator("rov2", name) for name in OPERATORS)
    try:
        for link in (flooder, other):
            assert until_answered(link, keys.COMMAND, b"") == b"narrow"
        for _ in range(120):
            flooder.send(keys.MODEL, bytes(32_768))
        # The question follows the models in the same queue.
        flooder.ask_and_wait(keys.BLOB, b"", 5.0)
        for _ in range(5):
            assert until_answered(other, keys.COMMAND, b"") == b"narrow"
        assert robot._sessions.main.reopened == 0
    finally:
        robot.close()
        relay.close()


def test_who_is_revoked_at_the_hub_is_out_while_the_others_go_on(encrypted: Sites):
    answer_by_name(encrypted)
    first, second = (encrypted.operator("rov1", name) for name in OPERATORS)
    for link in (first, second):
        until_answered(link, keys.COMMAND, b"")
    assert encrypted.registry is not None
    encrypted.registry.revoke("shore-1")

    def is_out() -> bool:
        answer = first.ask_and_wait(keys.RIGHT, b"", 1.0)
        why = explain_right(answer, "shore-1", "rov1") if answer is not None else None
        return why is not None and why.code == Code.REVOKED

    wait_until(is_out)
    assert first.ask_and_wait(keys.COMMAND, b"!", 0.5) is None
    assert until_answered(second, keys.COMMAND, b"!") == b"rov1!"


@pytest.mark.parametrize(
    ("certified", "vehicle", "site"),
    [
        ("rov1", "rov2", EVERY_SITE),  # a robot poses as another one
        ("shore-2", "rov1", EVERY_SITE),  # an operator poses as a robot
        ("half", "rov2", "shore-1"),  # an operator poses as another one
    ],
)
def test_nobody_speaks_under_a_name_that_its_certificate_does_not_have(
    tmp_path: Path, certified: str, vehicle: str, site: str
):
    with Sites(tmp_path, "tls") as fleet:
        answer_by_name(fleet)
        operator = fleet.operator(vehicle, "shore-1")
        assert until_answered(operator, keys.COMMAND, b"") == vehicle.encode()
        hand, reports = Heard(fleet.robots[vehicle], keys.STOP), Heard(operator, keys.TELEMETRY)
        false = fleet.link(vehicle, EVERY_SITE, certified)
        heard = Heard(false, keys.STOP)
        posing = keys.STOP if site != EVERY_SITE else keys.TELEMETRY
        if site != EVERY_SITE:
            false._site = site  # the name that its certificate does not have
        for _ in range(20):
            false.send(posing, (99).to_bytes(4, "big"))
        send_until(lambda: 1 in hand.items, lambda: operator.send(keys.STOP, (1).to_bytes(4, "big")))
        send_until(
            lambda: 2 in reports.items,
            lambda: fleet.robots[vehicle].send(keys.TELEMETRY, (2).to_bytes(4, "big")),
        )
        assert 99 not in (*hand.items, *reports.items)
        assert 1 not in heard.items  # of its own it hears what it sends


_COUNT_READERS = """
import sys
from pathlib import Path
from farhand.common.link.endpoint import EndpointSettings
from farhand.common.link.fleet import Fleet, follow_until
from farhand.common.link.hub import Hub

hub = Hub(EndpointSettings(listen=sys.argv[1]))
fleet = Fleet(EndpointSettings(connect=sys.argv[1]))
assert follow_until(fleet, lambda: fleet.is_connected, 60.0)
names = [task.joinpath("comm").read_text() for task in Path("/proc/self/task").iterdir()]
print(sum(name.startswith("rx-") for name in names))
fleet.close()
hub.close()
"""


def test_a_hubs_process_has_a_reader_for_each_connection_that_it_takes():
    # With fewer all of them can wait for connections that are being closed: the transport then stands still.
    command = [sys.executable, "-c", _COUNT_READERS, f"tcp/{HOST}:{free_port()}"]
    shown = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S, check=False)
    assert shown.returncode == 0, shown.stderr
    assert int(shown.stdout) > hub_configuration(EndpointSettings())["transport"]["unicast"]["max_sessions"]


def wait_until(holds: Callable[[], bool]) -> None:
    for _ in range(1000):
        if holds():
            return
        threading.Event().wait(0.02)
    raise AssertionError("it never came to hold")
