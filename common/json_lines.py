"""File of JSON lines, appended by a thread of its own: the events of a site on its disk.

A log that reaches its maximal size is renamed to `.1`, and a new one is begun, so that it never fills a disk.
A disk that is full or gone stops the log, not the site.
"""

from __future__ import annotations

import os
import queue
import threading
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, BinaryIO

import msgspec

from farhand.common.log import loop_logger

_log = loop_logger(__name__)

MAX_BYTES = 4_000_000


def json_line(at: datetime, fields: dict[str, Any]) -> bytes:
    """Return the line of one event.

    Types unknown to JSON are written as text: one odd value must not end a log.

    Args:
        at: Wall time, for the reader.
        fields: What happened.
    """
    return (
        msgspec.json.encode({"time": at.isoformat(timespec="milliseconds"), **fields}, enc_hook=str) + b"\n"
    )


class JsonLinesFile:
    """One file of JSON lines.

    Lines are appended in the order of the calls, each with the wall time.

    Args:
        path: The file; its folder is made.
        max_bytes: Size at which a new file is begun [B].
    """

    def __init__(self, path: Path, max_bytes: int = MAX_BYTES):
        self.path, self._max_bytes = path, max_bytes
        self.error: OSError | None = None
        """Reason why the newest event could not be written; None if it was."""
        self._waiting: queue.SimpleQueue[tuple[datetime, dict[str, Any]] | None] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._run, name="json lines", daemon=True)
        self._thread.start()

    def append(self, **fields: Any) -> None:
        """Write one event, together with the wall time for the reader. Never blocks."""
        self._waiting.put((datetime.now(UTC), fields))

    def close(self) -> None:
        """Write the waiting events, and end the thread."""
        self._waiting.put(None)
        self._thread.join(timeout=5.0)

    def _run(self) -> None:
        while (event := self._waiting.get()) is not None:
            try:
                self._write(json_line(*event))
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
