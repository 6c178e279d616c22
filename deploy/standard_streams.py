"""Standard input, output and error that decide nothing: closed, full, unread, or of another encoding.

What a command prints as its result is written when it can be, and its loss is told at the end. What is logged
waits for nobody: a thread writes it, and lines are dropped while nobody reads them (a paused pager, a stopped
terminal, a full disk). So no control period and no event loop ever waits for whoever reads the log.
"""

from __future__ import annotations

import contextlib
import errno
import io
import os
import select
import sys
import threading
from collections import deque
from collections.abc import Iterator
from typing import TextIO

_WAITING_BYTES = 1 << 18
"""Most of the log that waits for its reader [B]."""
_PATIENCE_S = 2.0
"""How long the end of the process waits for the reader of its last lines [s]."""
_LOST_STATUS = 2


class _Descriptor(io.RawIOBase):
    """Bytes to a file descriptor.

    Args:
        fd: The descriptor.
        was_closed: Whether the process was started without it.
    """

    def __init__(self, fd: int, was_closed: bool):
        self._fd = fd
        self.error: OSError | None = OSError(errno.EBADF, os.strerror(errno.EBADF)) if was_closed else None
        """Why something was lost or would be; None when nothing was."""

    def fileno(self) -> int:
        """See `io.RawIOBase`."""
        return self._fd

    def isatty(self) -> bool:
        """See `io.RawIOBase`."""
        return os.isatty(self._fd)

    def writable(self) -> bool:
        """See `io.RawIOBase`."""
        return True

    def _write_all(self, data: bytes) -> None:
        left = memoryview(data)
        while left:
            try:
                left = left[os.write(self._fd, left) :]
            except BlockingIOError:  # somebody who has the same terminal made it so
                select.select([], [self._fd], [])


class Output(_Descriptor):
    """Standard output. The first error ends the writing, not the work."""

    lost = False
    """Whether something was to be written that could not be."""

    def write(self, data) -> int:
        """Write all, or note that it could not be written."""
        if self.error is None:
            try:
                self._write_all(bytes(data))
            except OSError as error:
                self.error = error
        self.lost = self.lost or self.error is not None
        return len(data)


class Log(_Descriptor):
    """Standard error. Never waits, never fails; what nobody reads in time is dropped and counted."""

    def __init__(self, fd: int, was_closed: bool):
        super().__init__(fd, was_closed)
        self._changed = threading.Condition()
        self._waiting: deque[bytes] = deque()
        self._n_bytes = self._n_lost = 0
        threading.Thread(target=self._run, name="log", daemon=True).start()

    def write(self, data) -> int:
        """Have it written by the thread, or dropped."""
        line = bytes(data)
        with self._changed:
            if self._n_bytes + len(line) > _WAITING_BYTES:
                self._n_lost += 1
            else:
                self._waiting.append(line)
                self._n_bytes += len(line)
                self._changed.notify_all()
        return len(line)

    def drain(self, timeout_s: float) -> None:
        """Wait until all is written, for a while at most [s]."""
        with self._changed:
            self._changed.wait_for(lambda: not self._n_bytes, timeout_s)

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._n_bytes)
                line, lost = self._waiting.popleft(), self._n_lost
                self._n_lost = 0
            if lost:
                self._try_to_write(b"(%d lines were dropped here: nobody read them in time)\n" % lost)
            self._try_to_write(line)
            with self._changed:
                self._n_bytes -= len(line)
                self._changed.notify_all()

    def _try_to_write(self, line: bytes) -> None:
        # A full disk may have room again later: each line is tried.
        with contextlib.suppress(OSError):
            self._write_all(line)


class Streams:
    """The streams of this process at its end.

    Args:
        output: Standard output.
    """

    def __init__(self, output: Output):
        self._output = output

    def final_status(self, status: int) -> int:
        """Say when the result itself was lost.

        A reader that went away (`farhand model show MODEL | head -1`) has what it wanted: that is no loss.

        Args:
            status: The exit status so far.

        Returns:
            The exit status.
        """
        sys.stdout.flush()
        error = self._output.error
        if self._output.lost and error is not None and error.errno != errno.EPIPE:
            sys.stderr.write(
                f"farhand: standard output: cannot be written ({error.strerror}); choose another\n"
            )
            status = status or _LOST_STATUS
        return status


@contextlib.contextmanager
def standard_streams() -> Iterator[Streams]:
    """Have standard input, output and error decide nothing, for this block."""
    closed = [fd for fd in (0, 1, 2) if not _is_open(fd)]
    for fd in closed:
        # A file or socket that is opened later must not become what others take for standard error.
        if (opened := os.open(os.devnull, os.O_RDWR)) != fd:
            os.dup2(opened, fd)
            os.close(opened)
    output, log = Output(1, 1 in closed), Log(2, 2 in closed)
    before = sys.stdout, sys.stderr
    sys.stdout = _text(io.BufferedWriter(output), before[0], line_buffering=output.isatty())
    sys.stderr = _text(io.BufferedWriter(log), before[1], line_buffering=True)
    try:
        yield Streams(output)
    finally:
        log.drain(_PATIENCE_S)
        sys.stdout, sys.stderr = before


def _is_open(fd: int) -> bool:
    try:
        os.fstat(fd)
    except OSError:
        return False
    return True


def _text(raw: io.BufferedWriter, before: TextIO | None, *, line_buffering: bool) -> io.TextIOWrapper:
    """Return text over bytes, in the encoding of before; a sign that it does not know is written as its escape."""
    encoding = getattr(before, "encoding", None) or "utf-8"
    return io.TextIOWrapper(raw, encoding, errors="backslashreplace", line_buffering=line_buffering)
