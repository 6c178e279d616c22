"""Summary of the trials of one scenario of the arm: numbers, and a row of a table."""

from __future__ import annotations

from collections import Counter

import numpy as np

from farhand.evaluation.metrics.tables import rate, wilson_interval
from farhand.evaluation.study import Case

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
