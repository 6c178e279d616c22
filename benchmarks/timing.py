"""Timing on a shared machine: each function in turn, and the best of all rounds.

It measures the processor time of this thread, which does all the work: other programs then only affect the
caches and the shared core.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class BenchmarkRow:
    """Line of the table.

    Args:
        what: Name of what was timed.
        ours_us: Its time [us].
        peer: Name of the peer; empty for none.
        peer_us: The peer's time [us].
        target: Promised figure; empty for none.
    """

    what: str
    ours_us: float
    peer: str = ""
    peer_us: float | None = None
    target: str = ""


def best_times_us(functions: dict[str, Callable[[], object]], seconds: float = 1.0) -> dict[str, float]:
    """Return the least time of one call of each function [us].

    The functions take turns, so that other load on the machine meets all of them. A round of one lasts about
    two milliseconds, or one call; each gets at least five rounds.

    Args:
        functions: Functions to time; a call of each has compiled and warmed it.
        seconds: Total time [s].
    """
    calls, best = {}, {}
    for name, function in functions.items():
        function()
        began = time.thread_time()
        function()
        once = time.thread_time() - began
        calls[name], best[name] = max(1, int(2e-3 / max(once, 1e-7))), once
    rounds, end = 0, time.thread_time() + seconds
    while rounds < 5 or time.thread_time() < end:
        rounds += 1
        for name, function in functions.items():
            began = time.thread_time()
            for _ in range(calls[name]):
                function()
            best[name] = min(best[name], (time.thread_time() - began) / calls[name])
    return {name: 1e6 * value for name, value in best.items()}
