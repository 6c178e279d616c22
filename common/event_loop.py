"""Hand-over between threads: a bounded mailbox, a worker for long jobs, and a loop that one thread owns."""

from __future__ import annotations

import queue
import threading
from collections import deque
from collections.abc import Callable
from typing import Generic, TypeVar

from farhand.common.log import loop_logger

_log = loop_logger(__name__)

Job = Callable[[], None]


class EventLoop:
    """Runner of jobs, and of one periodic job of its own.

    In real time `start` gives it a thread. In virtual time the caller that advances the time calls `run_waiting`
    after each event and `tick` in each period.

    Args:
        name: Name of the thread.
        period_s: Time from one tick to the next [s].
        on_tick: Called each period.
        afterwards: Called after each of the other jobs, for example to redraw.
        now_s: Clock [s].
    """

    def __init__(
        self, name: str, period_s: float, on_tick: Job, afterwards: Job, now_s: Callable[[], float]
    ):  # fmt: skip
        self._period_s, self._on_tick, self._afterwards, self._now_s = period_s, on_tick, afterwards, now_s
        self._queue: queue.SimpleQueue[Job | None] = queue.SimpleQueue()
        self._ticked_s = now_s()
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)

    @property
    def waiting(self) -> int:
        """Number of waiting jobs."""
        return self._queue.qsize()

    @property
    def tick_age_s(self) -> float:
        """Time since the last tick [s]."""
        return self._now_s() - self._ticked_s

    def put(self, job: Job) -> None:
        """Have a job run; returns at once."""
        self._queue.put(job)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def close(self) -> None:
        """End the thread, if there is one; waiting jobs are dropped."""
        if self._thread.is_alive():
            self._queue.put(None)
            self._thread.join(timeout=5.0)

    def run_waiting(self) -> None:
        """Run all waiting jobs."""
        if self._queue.empty():
            return
        while not self._queue.empty():
            if (job := self._queue.get()) is not None:
                self._do(job)
        self._do(self._afterwards)

    def tick(self) -> None:
        """Run the periodic job."""
        self._ticked_s = self._now_s()
        self._do(self._on_tick)
        self._do(self._afterwards)

    def _run(self) -> None:
        due_s = self._now_s()
        while True:
            if (left_s := due_s - self._now_s()) <= 0.0:
                due_s = self._now_s() + self._period_s
                self.tick()
                continue
            try:
                job = self._queue.get(timeout=left_s)
            except queue.Empty:
                continue
            if job is None:
                return
            self._do(job)
            self._do(self._afterwards)

    def _do(self, job: Job) -> None:
        try:
            job()
        except Exception:
            # One bad message or intent must not end the loop.
            _log.exception("a job of the loop failed")


T = TypeVar("T")


class Mailbox(Generic[T]):
    """Bounded queue that never blocks its writer.

    Args:
        keep: Largest number of waiting items; with one, the reader sees the newest only.
    """

    def __init__(self, keep: int = 1):
        self._items: deque[T] = deque(maxlen=keep)
        self._arrived = threading.Event()

    def put(self, item: T) -> None:
        """Add an item; drop the oldest one when the mailbox is full."""
        self._items.append(item)
        self._arrived.set()

    def __len__(self) -> int:
        return len(self._items)

    def take_all(self, most: int | None = None) -> list[T]:
        """Return everything that waits, or at most `most` items, oldest first. Never blocks."""
        self._arrived.clear()
        items: list[T] = []
        while self._items and (most is None or len(items) < most):
            items.append(self._items.popleft())
        return items

    def wait(self, timeout_s: float) -> bool:
        """Wait until an item is there. Return False on a time-out."""
        return self._arrived.wait(timeout_s)


class Worker(Generic[T]):
    """Thread that runs its jobs in turn; the mailboxes bound the number of waiting jobs.

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
                    _log.exception("a job of the worker failed")
                job = None  # its references end now, not with the next job
