"""`farhand local --robots rov1,rov2`: one operator's site for several robots at a hub, a process for each of them.

Separate processes share nothing that could show or send one robot's data as another's, and a console that computes or
fails leaves STOP of the others alone. Each page has a row with all robots, which leads to their pages.
"""

from __future__ import annotations

import asyncio
import contextlib
import dataclasses
import logging
import signal
from typing import TYPE_CHECKING, Any

from farhand.common.errors import InvalidConfiguration, ProcessFailed
from farhand.deploy.child_process import Child, follow_parent, say_ready

if TYPE_CHECKING:
    from farhand.local_site.config import LocalConfig

_log = logging.getLogger(__name__)

_OWN = ("robots", "port", "pages", "connect_timeout_s")


def page_ports(names: tuple[str, ...], first: int) -> dict[str, int]:
    """Return the port of each robot's page: one after the other.

    Raises:
        InvalidConfiguration: When no port is given, or not all fit.
    """
    if not 0 < first <= 65536 - len(names):
        expected = "the port of the first robot's page, such as 8080; each of the others takes the next one"
        raise InvalidConfiguration("command line", "port", f"{expected}; got {first}")
    return {name: first + k for k, name in enumerate(names)}


def child_arguments(options: Any, robot: str, ports: dict[str, int]) -> list[str]:
    """Return the arguments of one robot's site: those of the command, for this robot alone.

    Args:
        options: The command's options, as a dataclass.
        robot: Name of the robot.
        ports: Port of each robot's page.
    """
    given = {field.name: getattr(options, field.name) for field in dataclasses.fields(options)}
    arguments = ["local"]
    for name, value in given.items():
        option = f"--{name.replace('_', '-')}"
        if name not in _OWN and value not in (None, False):
            arguments.append(option if value is True else f"{option}={value}")
    pages = ",".join(f"{name}={port}" for name, port in ports.items())
    timeout_s = given["connect_timeout_s"] or 0.0  # one robot that is not there must not end its page
    return [
        *arguments, f"--robots={robot}", f"--port={ports[robot]}", f"--pages={pages}",
        f"--connect-timeout-s={timeout_s:g}",
    ]  # fmt: skip


def run_consoles(options: Any, config: LocalConfig) -> int:
    """Run a site for each robot until SIGTERM, Ctrl-C or the end of the last one.

    Args:
        options: The command's options, as a dataclass.
        config: Configuration with these options.

    Returns:
        The exit status: 1 if one of them failed.

    Raises:
        InvalidConfiguration: When no port is given.
    """
    names = config.robot_names
    ports = page_ports(names, config.page_port)
    follow_parent()
    children = {name: Child(f"local ({name})", child_arguments(options, name, ports)) for name in names}
    return asyncio.run(_run(children, ports))


async def _run(children: dict[str, Child], ports: dict[str, int]) -> int:
    interrupted = asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, interrupted.set)
    for name, port in ports.items():
        _log.info("starting the site for %s, with its page at port %d", name, port)
    works = {name: asyncio.create_task(_serve(name, child)) for name, child in children.items()}
    everyone = asyncio.gather(*works.values())
    waiting = asyncio.create_task(interrupted.wait())
    ready = asyncio.create_task(_all_ready(children, ports))
    try:
        await asyncio.wait([everyone, waiting], return_when=asyncio.FIRST_COMPLETED)
        return 0 if not everyone.done() or all(everyone.result()) else 1
    finally:
        for task in (waiting, ready, everyone):
            task.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await task
        for child in children.values():
            await child.end()


async def _serve(name: str, child: Child) -> bool:
    """Run one robot's site; return True if it ended in order. The others go on in any case."""
    try:
        await child.start()
        _log.info("%s reports", name)
        if await child.wait() == 0:
            return True
        _log.error(child.exit_message())
    except ProcessFailed as error:
        _log.error(str(error))
    return False


async def _all_ready(children: dict[str, Child], ports: dict[str, int]) -> None:
    while not all(child.ready for child in children.values()):
        await asyncio.sleep(0.1)
    say_ready(pages=ports)
