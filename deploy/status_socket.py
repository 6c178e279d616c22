"""Server of `farhand status` in each process: a Unix socket in the user's runtime folder.

There is no request: every client is sent one line of JSON, a `ProcessStatus`. A killed process leaves a socket
that does not answer, and one that fails leaves a file with its last words; so both can be told from a process
that was never started.
"""

from __future__ import annotations

import contextlib
import logging
import os
import socket
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from urllib.parse import quote

import msgspec

from farhand.common.clock import elapsed_s
from farhand.common.errors import FarhandError, PortTaken
from farhand.common.process_status import DataFolder, Facts, ProcessStatus, Role
from farhand.common.temporary_folder import is_own
from farhand.common.version import installed_version
from farhand.common.whole_file import write_whole
from farhand.deploy.process_discovery import (
    ANSWER_S,
    ENDED,
    LastWords,
    remove_if_ended,
    runtime_folders,
    short_address,
)

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Identity:
    """Constant part of a process's status; see `ProcessStatus`."""

    role: Role
    name: str
    endpoint: str
    tasks: tuple[str, ...] = ()
    began_s: float = field(default_factory=elapsed_s)

    def status(self, facts: Facts | None, data: DataFolder | None) -> ProcessStatus:
        """Return the status with the present facts and the present state of the data folder."""
        return ProcessStatus(
            role=self.role, name=self.name, pid=os.getpid(), uptime_s=elapsed_s() - self.began_s,
            version=installed_version(), endpoint=self.endpoint, tasks=self.tasks, data=data, facts=facts,
        )  # fmt: skip


@contextlib.contextmanager
def serve_status(
    who: Identity, facts: Callable[[], Facts | None], data: Callable[[], DataFolder | None] = lambda: None
) -> Iterator[None]:
    """Answer `farhand status` while the block runs; leave the process's last words when an error ends it.

    Args:
        who: Identity of the process.
        facts: Returns the present state of the process, None while it starts. Called in the server's thread.
        data: Returns the state of the data folder, None for a process without one.
    """
    folder = _own_folder()
    if folder is None:
        log.warning(
            "`farhand status` will not find this process: set FARHAND_RUNTIME_DIR to a folder that only you may write"
        )
        yield
        return
    stem = _stem(who.role, who.name)
    _clear(folder, stem)
    path = folder / f"{stem}-{os.getpid()}"
    listener = _listen(path)
    answer = partial(_serve, listener, lambda: who.status(facts(), data()))
    threading.Thread(target=answer, name="status", daemon=True).start()
    try:
        with last_words(who.role, who.name):
            yield
    finally:
        with contextlib.suppress(OSError):
            path.unlink()
        with contextlib.suppress(OSError):
            listener.shutdown(socket.SHUT_RDWR)  # wakes the thread that waits there
        listener.close()


@contextlib.contextmanager
def last_words(role: Role, name: str) -> Iterator[None]:
    """Write the error that ends the block to a file, for `farhand status`."""
    try:
        yield
    except (FarhandError, OSError) as error:
        if (folder := _own_folder()) is not None:
            _leave_words(folder / f"{_stem(role, name)}{ENDED}", error)
        raise


def _stem(role: Role, name: str) -> str:
    return f"{role}-{quote(name, safe='')}"


def _own_folder() -> Path | None:
    for folder in runtime_folders():
        with contextlib.suppress(OSError):
            folder.mkdir(mode=0o700, exist_ok=True)
            if is_own(folder) and os.access(folder, os.W_OK):
                return folder
    return None


def _clear(folder: Path, stem: str) -> None:
    """Remove the files that ended processes of this name have left."""
    for path in folder.glob(f"{stem}[-.]*"):
        remove_if_ended(path)


def _listen(path: Path) -> socket.socket:
    path.unlink(missing_ok=True)
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    with short_address(path) as address:
        listener.bind(address)
    path.chmod(0o600)
    listener.listen(8)
    return listener


def _serve(listener: socket.socket, status: Callable[[], ProcessStatus]) -> None:
    while True:
        try:
            asking, _ = listener.accept()
        except OSError:
            return  # it was closed
        with asking:
            try:
                asking.settimeout(ANSWER_S)
                asking.sendall(msgspec.json.encode(status()) + b"\n")
            except OSError:
                continue  # the client has gone
            except Exception:
                log.exception("could not answer `farhand status`")


def _leave_words(path: Path, error: Exception) -> None:
    code = "port-taken" if isinstance(error, PortTaken) else "failed"
    words = LastWords(pid=os.getpid(), code=code, text=str(error), at_s=time.time())
    with contextlib.suppress(OSError):
        write_whole(path, msgspec.json.encode(words))
