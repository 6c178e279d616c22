"""Files read within bounds, written whole or not at all, by one process, with faults that name the file.

Every reader of a file works under `fault_of`, so that every fault of a file, foreseen or not, becomes that
file's error: a list of numpy's or zipfile's exceptions would never be complete.
"""

from __future__ import annotations

import contextlib
import errno
import fcntl
import os
import select
import stat
from collections.abc import Iterator
from pathlib import Path
from secrets import token_hex
from typing import Any

import msgspec

from farhand.common.errors import FarhandError, InvalidInput, field_of
from farhand.common.log import loop_logger

_log = loop_logger(__name__)

_LOCK = "in-use"
MAX_BYTES, _MAX_TOML_BYTES = 64_000_000, 1_000_000
"""Largest sizes that are read unless the reader says otherwise [B]."""
_PATIENCE_MS = 5000
"""Time without data after which a pipe is given up [ms]."""
_CANNOT_REPLACE = (errno.EACCES, errno.EPERM, errno.EBUSY, errno.EROFS)
"""Remark about the folder of a file that may itself be written, such as one mounted into a container."""


@contextlib.contextmanager
def fault_of(source: Path | str, invalid: type[InvalidInput], expected: str) -> Iterator[None]:
    """Turn every failure to read and decode a file into one error that names the file.

    Args:
        source: The file.
        invalid: Error class to raise.
        expected: Expected content, for a fault that does not name it.
    """
    try:
        yield
    except InvalidInput as error:
        raise invalid(str(source), error.field, error.expected) from None
    except msgspec.ValidationError as error:
        raise invalid(str(source), *field_of(error)) from error
    except OSError as error:
        raise invalid(str(source), "", f"a readable file ({error.strerror or error})") from error
    except Exception as error:
        reason = " ".join(str(error).split())[:200] or type(error).__name__
        raise invalid(str(source), "", f"{expected} ({reason})") from error


def read_whole(path: Path | str, most_bytes: int = MAX_BYTES) -> bytes:
    """Return the content of a file, or of a pipe that is being written.

    Raises:
        OSError: When it cannot be read, is larger than that, or sends nothing for some seconds.
    """
    # Opening a pipe that nobody writes would otherwise block forever.
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    parts, size = list[bytes](), 0
    with os.fdopen(descriptor, "rb", buffering=0) as file:
        waiting = select.poll()
        waiting.register(file, select.POLLIN)
        while waiting.poll(_PATIENCE_MS):
            part = file.read(1 << 20)
            if part == b"":
                return b"".join(parts)
            parts.append(part or b"")
            size += len(parts[-1])
            if size > most_bytes:
                raise OSError(errno.EFBIG, f"larger than {most_bytes} bytes", str(path))
    raise OSError(errno.ETIMEDOUT, "nothing came for some seconds", str(path))


def read_toml(path: Path) -> dict[str, Any]:
    """Return the tables of a TOML file, which may begin with a byte-order mark; errors pass unchanged."""
    return msgspec.toml.decode(read_whole(path, _MAX_TOML_BYTES).decode("utf-8-sig"))


def write_whole(path: Path | str, data: bytes, new_mode: int = 0o666) -> None:
    """Replace the file's content, safely even when the process is killed or the power fails meanwhile.

    A link stays a link: its target is replaced. Into anything but a regular file (a device, a pipe) the bytes
    are written directly. A new file has the mode that the umask leaves of `new_mode`, an old one keeps its
    own.

    Raises:
        OSError: When it cannot be written, naming the file as it was given; its content is unchanged.
    """
    try:
        target = Path(os.path.realpath(path))
        old = target.stat() if target.exists() else None
        if old is not None and not stat.S_ISREG(old.st_mode):
            _write_into(target, data)
            return
        try:
            _replace(target, data, old, new_mode)
        except OSError as error:
            if old is None or error.errno not in _CANNOT_REPLACE:
                raise
            _write_into(target, data)
    except OSError as error:
        raise OSError(error.errno, error.strerror or str(error), str(path)) from error


@contextlib.contextmanager
def all_or_none(*files: Path) -> Iterator[None]:
    """Delete these new files if the block, which writes them, fails."""
    try:
        yield
    except BaseException:
        for file in files:
            with contextlib.suppress(OSError):
                file.unlink(missing_ok=True)
        raise


def _replace(target: Path, data: bytes, old: os.stat_result | None, new_mode: int) -> None:
    """Write a new file beside the target and rename it."""
    temporary = target.with_name(f".new-{token_hex(6)}")
    descriptor = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, new_mode)
    try:
        with os.fdopen(descriptor, "wb") as file:
            if old is not None:
                os.fchmod(descriptor, stat.S_IMODE(old.st_mode))
                with contextlib.suppress(PermissionError):  # root keeps the owner; other users are the owner
                    os.fchown(descriptor, old.st_uid, old.st_gid)
            file.write(data)
            file.flush()
            os.fsync(descriptor)
        temporary.replace(target)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def _write_into(target: Path, data: bytes) -> None:
    """Write into an existing file; a pipe that nobody reads is an error, not a wait."""
    descriptor = os.open(target, os.O_WRONLY | os.O_TRUNC | os.O_NONBLOCK | os.O_CLOEXEC)
    os.set_blocking(descriptor, True)
    with os.fdopen(descriptor, "wb") as file:
        file.write(data)


class FolderInUse(FarhandError):
    """Folder in which another process keeps its files."""


class Claim:
    """Exclusive right to a folder's files as long as this object lives.

    Two processes would overwrite each other's files. The claim ends with the process, however that ends. A
    folder that cannot be written needs no claim.

    Args:
        folder: Folder; made when missing.
        what: Name of its content, for the message of a refusal.
        remedy: What to do about a refusal.

    Raises:
        FolderInUse: When another process has it.
    """

    def __init__(
        self,
        folder: Path,
        what: str,
        remedy: str = "end it, or give this one a folder of its own with --data-dir",
    ):
        self._descriptor = -1
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._descriptor = os.open(folder / _LOCK, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
            fcntl.flock(self._descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            holder = os.pread(self._descriptor, 20, 0).decode(errors="replace").strip()
            self.release()
            raise FolderInUse(
                f"{folder}: process {holder or 'unknown'} keeps {what} there: {remedy}"
            ) from None
        except OSError as error:
            _log.warning("%s cannot be claimed, another process may use it too: %s", folder, error.strerror)
            self.release()
        else:
            with contextlib.suppress(
                OSError
            ):  # on a full disk the claim holds, though it says not whose it is
                os.ftruncate(self._descriptor, 0)
                os.pwrite(self._descriptor, f"{os.getpid()}\n".encode(), 0)

    def release(self) -> None:
        """Release the folder."""
        if self._descriptor >= 0:
            os.close(self._descriptor)
            self._descriptor = -1

    def __enter__(self) -> Claim:
        return self

    def __exit__(self, *_: object) -> None:
        self.release()

    def __del__(self) -> None:
        self.release()
