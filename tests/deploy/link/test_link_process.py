"""`run_link`: the relay and its control together, in this process and in one of its own."""

from __future__ import annotations

import asyncio
import contextlib
import signal
import socket
import subprocess
import sys

import pytest

from farhand.common.address import Address
from farhand.common.errors import InvalidConfiguration, LinkError
from farhand.common.impairment.link_control import RelayControl
from farhand.deploy.link.link_process import run_link

HOST = "127.0.0.1"
ANY = (HOST, 0)

PROGRAM = """
import asyncio
from farhand.deploy.link.link_process import run_link
free = ("127.0.0.1", 0)
def ready(data, control):
    print(control[1], flush=True)
asyncio.run(run_link(free, ("127.0.0.1", 9), free, profile="leo", ready=ready))
print("ended", flush=True)
"""


def test_the_link_carries_and_obeys_once_it_is_ready():
    async def scenario() -> None:
        addresses: asyncio.Queue[tuple[Address, Address]] = asyncio.Queue()
        remote = await asyncio.start_server(lambda _, writer: writer.close(), HOST, 0)
        target = remote.sockets[0].getsockname()
        link = asyncio.create_task(
            run_link(ANY, target, ANY, profile="geo", ready=lambda *both: addresses.put_nowait(both))
        )
        data, control = await addresses.get()
        assert (await asyncio.to_thread(RelayControl(*control).profile, "lan"))["profile"] == "lan"
        reader, writer = await asyncio.open_connection(*data)
        assert await reader.read() == b""
        writer.close()
        await writer.wait_closed()
        link.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await link
        remote.close()
        await remote.wait_closed()
        assert asyncio.all_tasks() == {asyncio.current_task()}

    asyncio.run(scenario())


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_ends_the_process_in_order(number):
    with subprocess.Popen([sys.executable, "-c", PROGRAM], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout
        port = int(process.stdout.readline())
        assert RelayControl(HOST, port).status()["profile"] == "leo"
        process.send_signal(number)
        assert process.stdout.read() == "ended\n"
        assert process.wait(30) == 0


def test_a_control_port_in_use_ends_the_link_and_gives_its_data_port_back():
    with socket.create_server(ANY) as taken, socket.create_server(ANY) as reserved:
        data = reserved.getsockname()
        reserved.close()
        with pytest.raises(LinkError, match="is in use"):
            asyncio.run(run_link(data, (HOST, 9), taken.getsockname()))
        socket.create_server(data).close()


def test_an_unknown_profile_and_a_malformed_file_are_refused(tmp_path):
    with pytest.raises(InvalidConfiguration, match="one of lan, geo, leo, acoustic"):
        asyncio.run(run_link(ANY, (HOST, 9), ANY, profile="mars"))
    (tmp_path / "links.toml").write_text("[geo]\ndelay_ms = 3\n")
    with pytest.raises(InvalidConfiguration, match=r"links.toml"):
        asyncio.run(run_link(ANY, (HOST, 9), ANY, profiles_file=tmp_path / "links.toml"))


def test_the_link_loads_nothing_that_compiles():
    """It starts in a moment, anywhere: no kernel is imported by the command line, the process or its profiles."""
    modules = "farhand.deploy.cli, farhand.deploy.site_processes, farhand.deploy.link.link_process, farhand.deploy.status"
    words = f"import sys, {modules}; print(sorted(sys.modules.keys() & {{'numba', 'llvmlite', 'scipy', 'zenoh'}}))"
    done = subprocess.run((sys.executable, "-c", words), capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
