"""Record of one trial of the arm, and its summary.

Summary of the trials of one scenario of the arm: numbers, and a row of a table.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from farhand.common.arm.simulation.simulation import TICK_S
from farhand.common.wire.reasons import Code
from farhand.evaluation.metrics.tables import rate, wilson_interval
from farhand.evaluation.study import Case

Array = NDArray[np.float64]

HELD_S = 1.0
"""Time for which a plug must be in to count as held [s]."""
_TARED_TICKS = 50
_APPROACH_M = 0.05
_SINGULAR = 0.02

_KINDS: dict[str, str] = {
    Code.FORCE: "force",
    Code.JAMMED: "jammed too often",
    **dict.fromkeys((Code.TARGET_LOST, Code.TARGET_MOVED, Code.TARGET_TURNED), "perception lost"),
}
"""Names of the robot's reasons in the tables."""


@dataclass
class TrialRecord:
    """Record of a trial.

    The first two lists have one entry per control period, the third one per period in free water.

    Args:
        local: Poses of the tip in the true frame of the receptacle.
        force_n: Force on the tool, tared.
        behind: In free water, the tangent from the setpoint to the tip.
        least_singular_value: Least singular value of the arm's Jacobian, ten times a second.
        cause: Reason why it ended without success: a code of the robot, or a sentence; empty for a success.
        refusal: Reason why the kinematic pre-flight refused the trial; empty if it did not.
        inserted_s: Time when the plug was in for the first time.
        tick_s: Processor time of each control period, everything included [s].
    """

    local: list[Array] = field(default_factory=list)
    force_n: list[float] = field(default_factory=list)
    behind: list[Array] = field(default_factory=list)
    least_singular_value: list[float] = field(default_factory=list)
    cause: str = ""
    refusal: str = ""
    inserted_s: float = math.nan
    tick_s: float = math.nan

    @property
    def success(self) -> bool:
        """True if the plug was held in."""
        return not self.cause

    @property
    def peak_n(self) -> float:
        """Largest force since the sensor was tared [N]."""
        return max(self.force_n[_TARED_TICKS:], default=math.nan)

    @property
    def hold_n(self) -> float:
        """Median force of the last second [N]."""
        return float(np.median(self.force_n[-round(HELD_S / TICK_S) :]))

    @property
    def kind_of_failure(self) -> str:
        """Kind of failure, in words that can be counted; empty for a success."""
        singular = ", near a singularity" if min(self.least_singular_value, default=1.0) < _SINGULAR else ""
        if self.success:
            return ""
        if self.cause == "time":
            return ("stuck in the bore" if self.local[-1][2] > 0.0 else "not at the mouth in time") + singular
        return _KINDS.get(self.cause, self.cause.split(":")[0]) + singular

    @property
    def approach_deg(self) -> float:
        """Angle of the last 5 cm before the mouth with the axis; NaN when the plug never came there."""
        local = np.stack(self.local)[:, :3]
        behind = np.flatnonzero(local[:, 2] >= 0.0)
        before = np.flatnonzero(local[: behind[0], 2] <= -_APPROACH_M) if behind.size else behind
        if not before.size:
            return math.nan
        way = local[behind[0]] - local[before[-1]]
        return float(np.degrees(np.arctan2(np.hypot(way[0], way[1]), way[2])))

    def _free_rms(self, part: slice) -> float:
        """Return the root mean square distance of the tip from its setpoint in free water."""
        return (
            math.sqrt(np.mean([step[part] @ step[part] for step in self.behind])) if self.behind else math.nan
        )

    def row(self) -> Case:
        """Return what a study keeps of the record."""
        end = self.local[-1]
        return {
            "success": self.success,
            "cause": self.kind_of_failure,
            "refusal": self.refusal,
            "peak_n": self.peak_n,
            "hold_n": self.hold_n,
            "inserted_s": self.inserted_s,
            "end_depth_m": float(end[2]),
            "end_lateral_m": float(np.hypot(end[0], end[1])),
            "approach_deg": self.approach_deg,
            "free_rms_m": self._free_rms(slice(0, 3)),
            "free_rms_rad": self._free_rms(slice(3, 6)),
            "least_singular_value": min(self.least_singular_value, default=math.nan),
            "tick_ms": 1e3 * self.tick_s,
        }


HEADER = (
    "",
    "success",
    "required",
    "peak force, median / 95 % [N]",
    "holding, median / 95 % [N]",
    "beside the axis [mm]",
    "approach [deg]",
    "inserted after [s]",
    "processor per period [ms]",
)


def outcome_of(part: list[Case], required: float) -> Case:
    """Summarise what every task needs: successes and the required rate, causes of failure, peak force."""
    success = [r["success"] for r in part]
    peak_n = np.array([r["peak_n"] for r in part])
    return {
        "success_rate": float(np.mean(success)),
        "success_interval": wilson_interval(sum(success), len(success)),
        "required": required,
        "peak_median_n": float(np.median(peak_n)),
        "peak_p95_n": float(np.quantile(peak_n, 0.95)),
        "peak_max_n": float(np.max(peak_n)),
        "causes": dict(Counter(r["cause"] for r in part if r["cause"])),
        "failed_seeds": [r["seed"] for r in part if not r["success"]],
    }


def outcome_cells(name: str, part: list[Case], summary: Case) -> tuple[str, ...]:
    """Return the first three cells of a row: the scenario, its successes, the required rate."""
    wanted = f"{100 * summary['required']:g} %" if summary["required"] else ""
    return name, rate([r["success"] for r in part]), wanted


def summary_of(part: list[Case], required: float) -> Case:
    """Summarise the trials of one scenario; forces while holding are those of the successes."""
    good = [r for r in part if r["success"]] or part

    def values(rows: list[Case], key: str) -> np.ndarray:
        return np.array([r[key] for r in rows])

    return {
        **outcome_of(part, required),
        "hold_median_n": float(np.median(values(good, "hold_n"))),
        "hold_p95_n": float(np.quantile(values(good, "hold_n"), 0.95)),
        "lateral_median_m": float(np.median(values(good, "end_lateral_m"))),
        "approach_median_deg": float(np.nanmedian(values(part, "approach_deg"))),
        "inserted_median_s": float(np.median(values(good, "inserted_s"))),
        "free_rms_median_m": float(np.median(values(part, "free_rms_m"))),
        "free_rms_p95_m": float(np.quantile(values(part, "free_rms_m"), 0.95)),
        "free_rms_median_rad": float(np.median(values(part, "free_rms_rad"))),
        "tick_ms": float(np.mean(values(part, "tick_ms"))),
    }


def row_of(name: str, part: list[Case], summary: Case) -> tuple[str, ...]:
    """Return the row under `HEADER`."""
    return (
        *outcome_cells(name, part, summary),
        f"{summary['peak_median_n']:.0f} / {summary['peak_p95_n']:.0f}",
        f"{summary['hold_median_n']:.0f} / {summary['hold_p95_n']:.0f}",
        f"{summary['lateral_median_m'] * 1e3:.1f}",
        f"{summary['approach_median_deg']:.1f}",
        f"{summary['inserted_median_s']:.1f}",
        f"{summary['tick_ms']:.2f}",
    )
