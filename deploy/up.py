"""`farhand up` and `farhand demo`: the remote site, the link and the local site on this machine."""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import signal
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TypeVar

from farhand.common.address import bind, free_port
from farhand.common.errors import ProcessFailed
from farhand.common.temporary_folder import temporary_folder
from farhand.common.whole_file import write_whole
from farhand.deploy.child_process import Child, say_ready
from farhand.deploy.outcome import summary
from farhand.deploy.pki.throw_away import Identities, throw_away_identities
from farhand.deploy.places import check_writable, data_folder, site_name
from farhand.deploy.run_settings import RunSettings
from farhand.deploy.status_socket import last_words

_log = logging.getLogger(__name__)

_HOST = "127.0.0.1"
_OTHER_PORT = "choose another one with --port"
INTERRUPTED = 130
_SAID_EVERY_S, _LONG_S = 4.0, 10.0

T = TypeVar("T")


def run_demo(settings: RunSettings, outage: str, json_file: Path | None, data_dir: str) -> int:
    """Run the scripted job on this machine.

    Args:
        settings: Task, link, seed.
        outage: `none`, or kind:seconds of a cut in the middle of the execution.
        json_file: File for the result; None for none.
        data_dir: Folder for demonstrations and models; empty: a temporary folder, removed afterwards.

    Returns:
        The exit status: 0 only if the task succeeded.

    Raises:
        InvalidConfiguration: When there is no such task or profile, or the JSON file cannot be written.
        ProcessFailed: When one of the processes ended unexpectedly.
    """
    settings.check()
    if json_file is not None:
        check_writable("json", json_file)
    if data_dir:
        data_folder(data_dir)
    with tempfile.TemporaryDirectory(prefix="farhand-", dir=temporary_folder()) as scratch:
        result = Path(scratch) / "result.json"
        data = [f"--data-dir={data_dir or scratch}"]
        with throw_away_identities(settings.scheme, data_dir or scratch) as identities:
            job = ["--demo", f"--outage={outage}", f"--json={result}"]
            status = asyncio.run(_together(settings, data, job, identities))
        if not result.is_file():
            return status
        content = result.read_text(encoding="utf-8")
    for line in summary(json.loads(content)):
        _log.info(line)
    if json_file is not None:
        try:
            write_whole(json_file, content.encode())
        except OSError:
            sys.stdout.write(content)  # not lost with the file
            raise
    return status


def run_up(settings: RunSettings, port: int, data_dir: str) -> int:
    """Run both sites and the link, with the page of the local site, until Ctrl-C.

    Args:
        settings: Task, link, seed.
        port: Port of the page; 0 takes a free one.
        data_dir: Folder for demonstrations and models; empty: the user's data folder.

    Raises:
        InvalidConfiguration: When there is no such task or profile, or the data folder cannot be written.
        LinkError: When the page's port is in use.
        ProcessFailed: When one of the processes ended unexpectedly.
    """
    settings.check()
    folder = data_folder(data_dir)
    # A taken port is refused now, in one line, and not after a minute; `farhand status` reports it like the site's own.
    with last_words("operator", site_name(folder)), bind((_HOST, port), other_port=_OTHER_PORT) as free:
        port = free.getsockname()[1]
    _log.info("what is taught is kept in %s", folder)
    data = [f"--data-dir={data_dir}"] if data_dir else []
    with throw_away_identities(settings.scheme, data_dir) as identities:
        status = asyncio.run(_together(settings, data, [f"--port={port}"], identities))
    return 0 if status == INTERRUPTED else status


async def _together(
    settings: RunSettings, data: Sequence[str], local_arguments: Sequence[str], identities: Identities
) -> int:  # fmt: skip
    """Start remote, link and local in this order, and end them in the reverse one.

    Returns:
        The exit status of the local process with its scripted job, or `INTERRUPTED`.

    Raises:
        ProcessFailed: When one of the processes ended unexpectedly.
    """
    interrupted = asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, interrupted.set)
    children: list[Child] = []
    work = asyncio.create_task(_start_and_wait(settings, data, local_arguments, children, identities))
    waiting = asyncio.create_task(interrupted.wait())
    try:
        await asyncio.wait([work, waiting], return_when=asyncio.FIRST_COMPLETED)
        return work.result() if work.done() else INTERRUPTED
    finally:
        if not work.done():
            _log.info("ending the three processes")
        # The start is cancelled first, so that no child starts while the others are ended.
        for task in (work, waiting):
            task.cancel()
            with contextlib.suppress(asyncio.CancelledError, ProcessFailed):
                await task
        for child in reversed(children):
            await child.end()


async def _start_and_wait(
    settings: RunSettings, data: Sequence[str], local_arguments: Sequence[str], children: list[Child],
    identities: Identities,
) -> int:  # fmt: skip
    remote_port = free_port("tcp" if settings.scheme == "tcp" else "quic")
    task, seed = f"--task={settings.task}", f"--seed={settings.seed}"
    shared = [task, seed, f"--link-rate-bps={settings.rate_bps():g}", *data]
    end = f"{settings.scheme}/{_HOST}"
    remote = Child(
        "remote",
        [
            "remote",
            f"--listen={end}:{remote_port}",
            *_named("robot", settings.robot),
            *settings.driver_options(),
            *_named("config", str(settings.remote_config or "")),
            *identities.robot,
            *shared,
        ],
    )
    link = Child(
        "link",
        ["link", f"--listen={_HOST}:0", f"--target={_HOST}:{remote_port}", f"--control={_HOST}:0",
         f"--profile={settings.link}", seed],
    )  # fmt: skip
    children += [remote, link]
    _log.info("starting the remote site and the link (%s, %s)", settings.link, settings.scheme)
    remote_ready = asyncio.create_task(remote.start())
    try:
        ports = await link.start()
        connect = [
            f"--connect={end}:{ports['port']}",
            *identities.operator,
            f"--link-control={_HOST}:{ports['control_port']}",
        ]
        local = Child(
            "local", ["local", *connect, *_named("own-arm", settings.own_arm), *shared, *local_arguments]
        )
        children.append(local)
        _log.info("starting the local site")
        # The local site needs only the link's port, so it starts at the same time as the remote site.
        facts, _ = await _patiently(asyncio.gather(local.start(), remote_ready), children)
    finally:
        remote_ready.cancel()
    _log.info("all three are ready")
    say_ready(**facts)
    for line in first_steps(facts.get("page", "")):
        _log.info(line)
    ends = {asyncio.create_task(child.wait()): child for child in children}
    try:
        done, _ = await asyncio.wait(ends, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for end in ends:
            end.cancel()
    ended = local if any(ends[end] is local for end in done) else ends[done.pop()]
    status = await ended.wait()
    if ended is local and "--demo" in local_arguments and status >= 0:
        return status  # it has done its job, or told the reason why not
    raise ProcessFailed(ended.exit_message())


def _named(option: str, value: str) -> list[str]:
    return [f"--{option}={value}"] if value else []


async def _patiently(starting: asyncio.Future[T], children: Sequence[Child]) -> T:
    """Wait until the processes have started, and log that every few seconds: a slow first start is no hang."""
    began_s = time.monotonic()
    try:
        while not (await asyncio.wait([starting], timeout=_SAID_EVERY_S))[0]:
            waited_s = time.monotonic() - began_s
            names = " and ".join(child.name for child in children if not child.ready)
            first = (
                ""
                if waited_s < _LONG_S
                else ": the first start on a machine compiles the method, about a minute"
            )
            _log.info("  %s still starting, %.0f s%s", names, waited_s, first)
        return starting.result()
    finally:
        starting.cancel()
        with contextlib.suppress(asyncio.CancelledError, ProcessFailed):
            await starting  # else asyncio logs an exception that was never retrieved


def first_steps(page: str) -> list[str]:
    """Return the user's first steps; nothing without a page."""
    if not page:
        return []
    return [
        f"the page: {page}",
        "  first: press `Load samples`, `Send model`, `Arm`, `Preview`, `Execute`; or `Record` and show it how",
        "  Ctrl-C ends all three",
    ]
