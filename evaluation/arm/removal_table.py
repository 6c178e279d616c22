"""Summary of the trials of one scenario of `hot-stab-removal`: numbers, and a row of a table."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from farhand.evaluation.arm.arm_table import outcome_cells, outcome_of
from farhand.evaluation.study import Case

Array = NDArray[np.float64]

HEADER = (
    "",
    "success",
    "required",
    "peak force, median / 95 % / most [N]",
    "receptacle dragged, median / most [mm]",
    "from the stand-off, median / 95 % [mm]",
    "out of the mouth after [s]",
    "at the stand-off after [s]",
)


def summary_of(part: list[Case], required: float) -> Case:
    """Summarise the trials of one scenario, with the required rate of success."""
    dragged, away, out, reached = (
        np.array([r[key] for r in part]) for key in ("dragged_m", "away_m", "out_s", "reached_s")
    )
    return {
        **outcome_of(part, required),
        "dragged_median_m": float(np.median(dragged)),
        "dragged_max_m": float(dragged.max()),
        "away_median_m": float(np.median(away)),
        "away_p95_m": float(np.quantile(away, 0.95)),
        "out_median_s": _median_of_known(out),
        "reached_median_s": _median_of_known(reached),
    }


def _median_of_known(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if known.size else math.nan


def row_of(name: str, part: list[Case], summary: Case) -> tuple[str, ...]:
    """Return the row under `HEADER`."""
    return (
        *outcome_cells(name, part, summary),
        f"{summary['peak_median_n']:.0f} / {summary['peak_p95_n']:.0f} / {summary['peak_max_n']:.0f}",
        f"{summary['dragged_median_m'] * 1e3:.1f} / {summary['dragged_max_m'] * 1e3:.1f}",
        f"{summary['away_median_m'] * 1e3:.1f} / {summary['away_p95_m'] * 1e3:.1f}",
        f"{summary['out_median_s']:.1f}",
        f"{summary['reached_median_s']:.1f}",
    )
