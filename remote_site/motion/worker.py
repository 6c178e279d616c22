"""Thread that does long jobs for a loop that must not wait for them."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Generic, TypeVar

from farhand.common.log import loop_logger
from farhand.common.mailbox import Mailbox

_log = loop_logger(__name__)
T = TypeVar("T")


class Worker(Generic[T]):
    """Thread that does its jobs one after the other; the mailboxes bound how many wait.

    Args:
        name: Name of the thread.
        do: Does one job; an error in it is logged, and the next one is done.
        boxes: Waiting jobs; those of the first mailbox come before those of the second.
    """

    def __init__(self, name: str, do: Callable[[T], None], *boxes: Mailbox[T]):
        self._do, self._boxes = do, boxes
        self._wanted = threading.Semaphore(0)
        self._closed = False
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def submit(self, job: T, box: int = 0) -> None:
        """Have a job done. Never blocks."""
        self._boxes[box].put(job)
        self._wanted.release()

    def close(self) -> None:
        """End the worker."""
        self._closed = True
        self._wanted.release()
        self._thread.join(timeout=5.0)

    def _run(self) -> None:
        while True:
            self._wanted.acquire()
            if self._closed:
                return
            for job in [job for box in self._boxes for job in box.take_all()]:
                try:
                    self._do(job)
                except Exception:
                    _log.exception("a job could not be done")
                job = None  # its references end now, not with the next job
