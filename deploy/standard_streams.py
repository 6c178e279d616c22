"""Standard input, output and error that never block or fail: closed, full, unread, or of another encoding.

The printed result of a command is written if possible, and its loss is reported at the end. The log never
blocks: a thread writes it, and lines are dropped while nobody reads them (a paused pager, a stopped terminal,
a full disk). So no control period and no event loop ever waits for a reader of the log.
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
"""Largest part of the log that waits for its reader [B]."""
_PATIENCE_S = 2.0
"""Time for which the end of the process waits for the last lines to be read [s]."""
_LOST_STATUS = 2


class _Descriptor(io.RawIOBase):
    """Raw stream to a file descriptor.

    Args:
        fd: The descriptor.
        was_closed: True if the process was started without this descriptor.
    """

    def __init__(self, fd: int, was_closed: bool):
        self._fd = fd
        self.error: OSError | None = OSError(errno.EBADF, os.strerror(errno.EBADF)) if was_closed else None
        """Error that has lost output, or would lose it; None for none."""

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
            except BlockingIOError:  # another process has set the shared terminal to non-blocking
                select.select([], [self._fd], [])


class Output(_Descriptor):
    """Standard output. After the first error nothing more is written, and the command continues."""

    lost = False
    """True once output was lost."""

    def write(self, data) -> int:
        """Write the data, or note its loss."""
        if self.error is None:
            try:
                self._write_all(bytes(data))
            except OSError as error:
                self.error = error
        self.lost = self.lost or self.error is not None
        return len(data)


class Log(_Descriptor):
    """Standard error. It never blocks and never fails; lines that nobody reads in time are dropped and counted."""

    def __init__(self, fd: int, was_closed: bool):
        super().__init__(fd, was_closed)
        self._changed = threading.Condition()
        self._waiting: deque[bytes] = deque()
        self._n_bytes = self._n_lost = 0
        threading.Thread(target=self._run, name="log", daemon=True).start()

    def write(self, data) -> int:
        """Queue the data for the writing thread, or drop it."""
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
        """Wait until all queued lines are written, at most for a time [s]."""
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


class OutputStreams:
    """Standard streams at the end of the process.

    Args:
        output: Standard output.
    """

    def __init__(self, output: Output):
        self._output = output

    def final_status(self, status: int) -> int:
        """Report the loss of the result, and return the exit status.

        A reader that closes the pipe early (`farhand model show MODEL | head -1`) causes no loss.

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
def standard_streams() -> Iterator[OutputStreams]:
    """Replace the standard streams, for this block, by those that never block or fail."""
    closed = [fd for fd in (0, 1, 2) if not _is_open(fd)]
    for fd in closed:
        # Else a file or socket that is opened later would get the descriptor of standard error.
        if (opened := os.open(os.devnull, os.O_RDWR)) != fd:
            os.dup2(opened, fd)
            os.close(opened)
    output, log = Output(1, 1 in closed), Log(2, 2 in closed)
    before = sys.stdout, sys.stderr
    sys.stdout = _text(io.BufferedWriter(output), before[0], line_buffering=output.isatty())
    sys.stderr = _text(io.BufferedWriter(log), before[1], line_buffering=True)
    try:
        yield OutputStreams(output)
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
    """Return a text stream over bytes, in the encoding of `before`; unknown characters are written as escapes."""
    encoding = getattr(before, "encoding", None) or "utf-8"
    return io.TextIOWrapper(raw, encoding, errors="backslashreplace", line_buffering=line_buffering)
