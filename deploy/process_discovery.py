"""Discovery of this user's processes on this machine, and their answers.

Each process has a Unix socket in the user's runtime folder: see `farhand.deploy.status_socket`. A killed process
leaves a socket that does not answer; one that failed leaves a file with its last words.
"""

from __future__ import annotations

import contextlib
import os
import socket
import time
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import unquote

import msgspec
from msgspec import Struct

from farhand.common.errors import InvalidMessage
from farhand.common.process_status import ProcessStatus
from farhand.common.temporary_folder import NoTemporaryFolder, is_own, own_temporary_folder
from farhand.common.whole_file import fault_of, read_whole

ANSWER_S = 2.0
"""Time limit of an answer [s]."""
MAX_BYTES = 65536
ENDED = ".ended"


class LastWords(Struct, frozen=True, kw_only=True):
    """Error that ended a process.

    Args:
        pid: Process id.
        code: `port-taken` or `failed`.
        text: Message of the error.
        at_s: Time of the end, in seconds of the epoch [s].
    """

    pid: int
    code: str
    text: str
    at_s: float


class Entry(Struct, frozen=True, kw_only=True):
    """Process as found in the runtime folder.

    Args:
        role: Role of the process.
        name: Name of the process, as in `ProcessStatus`.
        pid: Process id.
        status: Answer of the process; None without one.
        fault: Kind of missing answer: `dead`, `ended`, `silent` or `foreign`; empty with an answer.
        words: Last words of a process that ended by an error; None for others.
    """

    role: str
    name: str
    pid: int
    status: ProcessStatus | None = None
    fault: str = ""
    words: LastWords | None = None


def runtime_folders() -> list[Path]:
    """Return the folders that may hold the sockets; a process uses the first that it can write."""
    if chosen := os.environ.get("FARHAND_RUNTIME_DIR"):
        return [Path(chosen)]
    of_session = os.environ.get("XDG_RUNTIME_DIR") or f"/run/user/{os.getuid()}"
    folders = [Path(of_session) / "farhand"]
    with contextlib.suppress(NoTemporaryFolder):
        folders.append(own_temporary_folder())
    return folders


def find_processes() -> list[Entry]:
    """Ask every process of this user on this machine, one after the other."""
    found: list[Entry] = []
    for path in _files():
        if (entry := read_entry(path)) is not None:
            found.append(entry)
    return found


def forget_ended() -> None:
    """Remove the files that ended processes have left."""
    for path in _files():
        remove_if_ended(path)


def _files() -> list[Path]:
    """Return the files of the runtime folders, but for folders into which another user may have put them."""
    found: list[Path] = []
    for folder in runtime_folders():
        with contextlib.suppress(OSError):
            found += sorted(folder.iterdir()) if is_own(folder) else []
    return found


def remove_if_ended(path: Path) -> None:
    """Remove a file of the folder if its process has ended."""
    entry = read_entry(path)
    if entry is not None and entry.fault in ("dead", "ended"):
        path.unlink(missing_ok=True)


def read_entry(path: Path) -> Entry | None:
    """Return the process of one file in the folder; None if the file is not Farhand's."""
    if path.suffix == ENDED:
        role, _, name = path.stem.partition("-")
        with contextlib.suppress(InvalidMessage), fault_of(path, InvalidMessage, "last words"):
            words = msgspec.json.decode(read_whole(path, MAX_BYTES), type=LastWords)
            return Entry(role=role, name=unquote(name), pid=words.pid, fault="ended", words=words)
        return None
    stem, _, pid = path.name.rpartition("-")
    role, _, name = stem.partition("-")
    if not path.is_socket() or not pid.isdecimal():
        return None
    status, fault = _ask(path)
    return Entry(role=role, name=unquote(name), pid=int(pid), status=status, fault=fault)


def _ask(path: Path) -> tuple[ProcessStatus | None, str]:
    """Return the answer of a process, or the kind of fault without one."""
    try:
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as asking, short_address(path) as address:
            asking.settimeout(ANSWER_S)
            asking.connect(address)
            said = _read_all(asking)
        with fault_of(path, InvalidMessage, "a status"):
            return msgspec.json.decode(said, type=ProcessStatus), ""
    except (ConnectionRefusedError, FileNotFoundError):
        return None, "dead"
    except OSError:
        return None, "silent"
    except InvalidMessage:
        return None, "foreign"


def _read_all(asking: socket.socket) -> bytes:
    until_s, data = time.monotonic() + ANSWER_S, b""
    while time.monotonic() < until_s and len(data) <= MAX_BYTES:
        part = asking.recv(MAX_BYTES)
        if not part:
            break
        data += part
    if not data:
        raise ConnectionError("no answer")
    return data


@contextlib.contextmanager
def short_address(path: Path) -> Iterator[str]:
    """Give a socket's path through its folder's descriptor: an address has 107 bytes and no more."""
    descriptor = os.open(path.parent, os.O_RDONLY | os.O_DIRECTORY)
    try:
        yield f"/proc/self/fd/{descriptor}/{path.name}"
    finally:
        os.close(descriptor)
