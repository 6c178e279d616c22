"""Durations and lateness of control periods, as numbers that are written once a minute."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

PERIOD_S = 60.0
"""Time that one line is about [s]."""


class TickTimes:
    """Collector of the times of control periods.

    Args:
        write: Writes one line, from its fields; never blocks.
        control_hz: Control periods per second [Hz].
    """

    def __init__(self, write: Callable[..., Any], control_hz: float):
        self._write, self._n = write, round(PERIOD_S * control_hz)
        self._cpu_s: list[float] = []
        self._late_s: list[float] = []

    def add(self, cpu_s: float, late_s: float, overruns: int) -> None:
        """Add one control period.

        Args:
            cpu_s: Processor time of the control loop's own thread [s].
            late_s: How late it began [s].
            overruns: How many came so late in this boot that they were left out.
        """
        self._cpu_s.append(cpu_s)
        self._late_s.append(late_s)
        if len(self._cpu_s) >= self._n:
            self.tell(overruns)

    def tell(self, overruns: int) -> None:
        """Write the numbers, and start again from zero."""
        if not self._cpu_s:
            return
        fields: dict[str, float] = {"n": len(self._cpu_s), "overruns": overruns}
        for name, times_s in (("cpu", self._cpu_s), ("late", self._late_s)):
            for part, value in zip(
                ("p50", "p99", "max"), np.quantile(times_s, (0.5, 0.99, 1.0)), strict=True
            ):
                fields[f"{name}_{part}_ms"] = round(1e3 * float(value), 3)
            times_s.clear()
        self._write(kind="ticks", **fields)
