"""Queue of jobs from any thread, run one after the other by one thread, or in virtual time."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable

from farhand.common.log import loop_logger

_log = loop_logger(__name__)

Job = Callable[[], None]


class EventLoop:
    """Runner of jobs, and of one periodic job of its own.

    In real time `start` gives it a thread. In virtual time whoever advances the time calls `run_waiting`
    after each event and `tick` each period.

    Args:
        name: Name of the thread.
        period_s: Time from one tick to the next [s].
        on_tick: Called each period.
        afterwards: Called after the other jobs, when something may have changed.
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
            _log.exception("something could not be done")
