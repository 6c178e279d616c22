"""Logging: one line per fact, coloured on a terminal, rate-limited inside loops; and a log of events on disk.

A log that reaches its maximal size is renamed to `.1`, and a new one is begun, so that it never fills a disk.
A disk that is full or gone stops the log, not the site.
"""

from __future__ import annotations

import logging
import os
import queue
import sys
import threading
import time
import warnings
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, BinaryIO

import msgspec

_FORMAT = "%(asctime)s %(levelname)-7s %(name)s: %(message)s"


class RateLimitFilter(logging.Filter):
    """Filter that lets each line of code log once per period, and adds the number of dropped records.

    Args:
        period_s: Shortest time between two records of the same file and line [s].
    """

    def __init__(self, period_s: float = 1.0):
        super().__init__()
        self._period_s = period_s
        self._last_s: dict[tuple[str, int], float] = {}
        self._silent: dict[tuple[str, int], int] = {}

    def filter(self, record: logging.LogRecord) -> bool:
        """Decide whether a record is logged."""
        place, now_s = (record.pathname, record.lineno), time.monotonic()
        if now_s - self._last_s.get(place, -self._period_s) < self._period_s:
            self._silent[place] = self._silent.get(place, 0) + 1
            return False
        self._last_s[place] = now_s
        if silent := self._silent.pop(place, 0):
            record.msg = f"{record.msg} (and {silent} more like it)"
        return True


def loop_logger(name: str) -> logging.Logger:
    """Return a rate-limited logger for code that runs many times a second."""
    logger = logging.getLogger(name)
    if not any(isinstance(present, RateLimitFilter) for present in logger.filters):
        logger.addFilter(RateLimitFilter())
    return logger


def _one_line(
    message: Warning | str, category: type[Warning], file: str, number: int, _line: str | None = None
) -> str:
    return f"{category.__name__} in {file}:{number}: {' '.join(str(message).split())}"


def configure_logging(process: str, verbose: bool = False) -> None:
    """Send this process's log to standard error.

    Args:
        process: Name of the process, put in front of each line of a child process.
        verbose: Show debug records as well.
    """
    handler: logging.Handler
    if sys.stderr.isatty():
        from rich.console import Console
        from rich.logging import RichHandler

        handler = RichHandler(console=Console(stderr=True), show_path=False)
        handler.setFormatter(logging.Formatter(f"{process}: %(message)s"))
    else:
        handler = logging.StreamHandler()
        handler.setFormatter(logging.Formatter(_FORMAT.replace("%(name)s", process)))
    logging.basicConfig(level=logging.DEBUG if verbose else logging.INFO, handlers=[handler], force=True)
    # dm_control logs at every start which OpenGL it does not load, which reads like a failure.
    # A library's warning becomes a line of the log.
    warnings.formatwarning = _one_line
    logging.captureWarnings(True)
    logging.getLogger("absl").setLevel(logging.NOTSET if verbose else logging.WARNING)


_log = loop_logger(__name__)

MAX_BYTES = 4_000_000


class EventLog:
    """Writer that appends to one file.

    Args:
        path: The file; its folder is made.
        max_bytes: Size at which a new file is begun [B].
    """

    def __init__(self, path: Path, max_bytes: int = MAX_BYTES):
        self.path, self._max_bytes = path, max_bytes
        self.error: OSError | None = None
        """Reason why the newest event could not be written; None if it was."""
        self._waiting: queue.SimpleQueue[dict[str, Any] | None] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._run, name="event log", daemon=True)
        self._thread.start()

    def append(self, **fields: Any) -> None:
        """Write one event, together with the wall time for the reader. Never blocks."""
        now = datetime.now(UTC).isoformat(timespec="milliseconds")
        self._waiting.put({"time": now, **fields})

    def close(self) -> None:
        """Write the waiting events, and end the thread."""
        self._waiting.put(None)
        self._thread.join(timeout=5.0)

    def _run(self) -> None:
        while (fields := self._waiting.get()) is not None:
            try:
                # Types unknown to JSON are written as text: one odd value must not end the log.
                self._write(msgspec.json.encode(fields, enc_hook=str) + b"\n")
                self.error = None
            except OSError as error:
                self.error = error
                _log.warning("could not write an event to %s: %s", self.path, error.strerror)

    def _write(self, line: bytes) -> None:
        self.path.parent.mkdir(parents=True, exist_ok=True)
        if self.path.exists() and self.path.stat().st_size + len(line) > self._max_bytes:
            self.path.replace(self.path.with_name(self.path.name + ".1"))
        with self.path.open("ab+") as file:
            if file.tell() and self._cut_short(file):
                line = b"\n" + line
            file.write(line)

    @staticmethod
    def _cut_short(file: BinaryIO) -> bool:
        """Decide whether the last line was cut short: the next line must not be appended to it."""
        file.seek(-1, os.SEEK_END)
        return file.read(1) != b"\n"
