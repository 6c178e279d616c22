"""Each network carries what it says and nothing else: read from the kernels' own lists of connections."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from farhand.common.address import free_port
from tests.containers.engine import BUILD_S
from tests.containers.place import SERVICES, Place

pytestmark = [pytest.mark.containers, pytest.mark.timeout(BUILD_S)]

DATA, CONTROL, PAGE = 7447, 7448, 8080
_OUTSIDE, _HERE = "203.0.113.2", "203.0.113.1"
_REACH = """
import socket, sys
from concurrent.futures import ThreadPoolExecutor
def reached(target):
    address, _, port = target.rpartition(":")
    try:
        socket.create_connection((address, int(port)), 2).close()
    except OSError:
        return False
    return True
targets = sys.argv[1:]
with ThreadPoolExecutor(len(targets)) as pool:
    print(*(target for target, there in zip(targets, pool.map(reached, targets)) if there))
"""
"""Prints which of its arguments, addresses with a port, a connection can be made to."""
_SENDERS = """
import sys
from farhand.common.impairment.link_control import RelayControl
print(*RelayControl(sys.argv[1], int(sys.argv[2])).status()["senders"])
"""
"""Prints whose datagrams the link carries."""


@pytest.fixture(scope="module")
def addresses(place: Place) -> dict[str, dict[str, str]]:
    """Each service's address in each of its networks."""
    place.await_troubles("operator", set())
    return {service: place.networks(service) for service in SERVICES}


def test_each_container_is_on_its_networks_alone(addresses: dict[str, dict[str, str]]) -> None:
    assert addresses["robot"].keys() == {"subsea"}
    assert addresses["link"].keys() == {"subsea", "shore", "control"}
    assert addresses["operator"].keys() == {"shore", "control", "page"}


def test_the_link_speaks_with_the_robot_over_subsea_by_datagrams_alone(place: Place, addresses) -> None:
    robot, link = addresses["robot"]["subsea"], addresses["link"]["subsea"]
    far = {(own, other) for own, _, other, port in place.connections("link", "udp") if port == DATA}
    assert far == {(link, robot)}
    assert {port for _, port, _, _ in place.connections("robot")} <= {DATA}  # it connects to nobody


def test_the_operators_data_goes_over_shore_and_the_relays_settings_over_control(
    place: Place, addresses
) -> None:
    operator, link = addresses["operator"], addresses["link"]
    senders = place.run("operator", "python3", "-c", _SENDERS, "link-control", str(CONTROL)).split()
    assert {sender.rpartition(":")[0] for sender in senders} == {operator["shore"]}
    control = {(own, other) for own, _, other, port in place.connections("operator") if port == CONTROL}
    assert control <= {(operator["control"], link["control"])}  # it is asked once a second, and closed again
    assert not {port for *_, port in place.connections("operator")} & {DATA}


def test_the_relay_s_settings_are_out_of_the_robots_reach(place: Place, addresses) -> None:
    settings = [f"{address}:{CONTROL}" for address in addresses["link"].values()]
    assert len(settings) == 3 and reached(place, "robot", *settings) == set()
    there = f"{addresses['link']['control']}:{CONTROL}"
    assert reached(place, "operator", there) == {there}


def test_the_page_is_published_at_loopback_alone(place: Place) -> None:
    listening = subprocess.run(("ss", "-Hltn"), capture_output=True, text=True, check=True).stdout.split()
    assert [word for word in listening if word.endswith(f":{place.page_port}")] == [
        f"127.0.0.1:{place.page_port}"
    ]


def test_only_who_comes_from_this_machine_needs_no_token(place: Place) -> None:
    """A neighbour of the container, who says that it is at loopback, comes from another address than the gateway."""
    engine = place.engine
    container = place.networks("operator")["page"]
    ask = (
        "import sys, http.client; c = http.client.HTTPConnection(sys.argv[1], 8080, timeout=5); "
        "c.request('GET', '/', headers={'Host': '127.0.0.1:8080'}); print(c.getresponse().status)"
    )
    network = f"--network={engine.project}_page"
    neighbour = ("run", "--rm", network, "--entrypoint=python3", "farhand", "-c", ask, container)
    assert engine.do(*neighbour, timeout_s=60.0) == "403"
    assert place.page_answers()


@pytest.fixture
def outside(tmp_path: Path) -> Iterator[str]:
    """A machine outside, that this one can reach and that knows no way to the containers' own addresses: its address."""
    name, port = f"farhand{free_port()}", free_port()
    commands = (
        f"ip netns add {name}", f"ip link add {name[:13]}a type veth peer name {name[:13]}b netns {name}",
        f"ip addr add {_HERE}/30 dev {name[:13]}a", f"ip link set {name[:13]}a up",
        f"ip -n {name} addr add {_OUTSIDE}/30 dev {name[:13]}b", f"ip -n {name} link set {name[:13]}b up",
    )  # fmt: skip
    try:
        for command in commands:
            subprocess.run(command.split(), check=True, capture_output=True)
    except (OSError, subprocess.CalledProcessError) as error:
        pytest.skip(f"a machine outside needs root and iproute2: {error}")
    serve = ("ip", "netns", "exec", name, "python3", "-u", "-m", "http.server", str(port))
    with subprocess.Popen(serve, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as server:
        try:
            assert server.stdout is not None and b"Serving" in server.stdout.readline()
            yield f"{_OUTSIDE}:{port}"
        finally:
            server.kill()
    subprocess.run(("ip", "netns", "del", name), check=False)


def test_no_container_can_connect_to_a_machine_outside(place: Place, outside: str) -> None:
    usual = ("run", "--rm", "--entrypoint=python3", "farhand", "-c", _REACH, outside)
    assert (
        place.engine.do(*usual, timeout_s=60.0) == outside
    )  # from the engine's usual network it can be done
    with ThreadPoolExecutor(len(SERVICES)) as pool:
        found = pool.map(lambda service: reached(place, service, outside), SERVICES)
        assert list(found) == [set()] * len(SERVICES)


def reached(place: Place, service: str, *targets: str) -> set[str]:
    """To which addresses a connection can be made from inside a container."""
    return set(place.run(service, "python3", "-c", _REACH, *targets).split())
