"""Record of an execution that ends with tracking a target: the distance from it since the arrival."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from farhand.remote_site.interface.perception import Perception
from farhand.remote_site.interface.plant import EffectorState

_RECORD_S = 10.0
"""Time after the arrival over which the error is accumulated [s]."""


class TrackingRecord:
    """Distance to the true target after the arrival.

    Args:
        perception: Knows the true target, if anybody can.
    """

    def __init__(self, perception: Perception):
        self._perception = perception
        self._sum_squares = 0.0
        self._n = 0
        self.tracked_s = 0.0
        self.newest_m: float | None = None

    def measure(self, effector: EffectorState, arrived: bool, now_s: float, dt_s: float) -> None:
        """See `Record.measure`."""
        truth_m = self._perception.true_origin_m(now_s) if arrived else None
        if truth_m is not None:
            self.add(float(np.linalg.norm(effector.position_m - truth_m)), dt_s)

    def add(self, distance_m: float, dt_s: float) -> None:
        """Record one control period."""
        self.newest_m = distance_m
        if self.tracked_s < _RECORD_S:
            self._sum_squares += distance_m**2
            self._n += 1
            self.tracked_s += dt_s

    @property
    def rms_m(self) -> float | None:
        """Root mean square over the recorded time [m]."""
        return math.sqrt(self._sum_squares / self._n) if self._n else None

    def fields(self) -> dict[str, Any]:
        """See `Record.fields`."""
        return {"tracked_s": self.tracked_s, "rms_error_m": self.rms_m, "end_error_m": self.newest_m}
