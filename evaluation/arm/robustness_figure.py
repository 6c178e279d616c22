"""Figure of the arm's robustness: success in each scenario, and over the bias of the tracker."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

_COLOURS = ("#b2182b", "#e08214", "#1b7837")


class SuccessRate(NamedTuple):
    """Rate of success.

    Args:
        value: Rate from 0 to 1.
        interval: Interval of 95 %.
        required: Required rate; zero for none.
    """

    value: float
    interval: tuple[float, float]
    required: float = 0.0


def draw_rates(
    scenarios: Mapping[str, SuccessRate],
    grid: Mapping[str, Mapping[int, Sequence[SuccessRate]]],
    grid_mm: Sequence[int],
) -> Figure:
    """Draw a line for each scenario above, and a picture for each bias of the orientation below.

    Args:
        scenarios: Rate of success in each.
        grid: Rate of success for each robot and each bias in degrees, over the biases of the position.
        grid_mm: Biases of the position [mm].
    """
    figure = Figure(figsize=(11.0, 8.6), layout="constrained")
    above, below = np.asarray(figure.subfigures(2, 1, height_ratios=(1.15, 1.0)))
    _draw_scenarios(above.subplots(), scenarios)
    degrees = list(next(iter(grid.values())))
    for axes, bias_deg in zip(below.subplots(1, len(degrees), sharey=True), degrees, strict=True):
        for colour, (robot, rates) in zip(_COLOURS, grid.items(), strict=True):
            values = 100 * np.array([rate.value for rate in rates[bias_deg]])
            low, high = 100 * np.array([rate.interval for rate in rates[bias_deg]]).T
            axes.plot(grid_mm, values, "o-", color=colour, label=robot)
            axes.fill_between(grid_mm, low, high, color=colour, alpha=0.13, linewidth=0)
        axes.set(
            title=f"tracker turned by {bias_deg} degrees per axis",
            xlabel="and displaced by, per axis [mm]",
            ylim=(-4, 104),
        )
        axes.set_xticks(grid_mm)
        axes.grid(alpha=0.3)
        axes.label_outer()
    below.axes[0].set_ylabel("success [%]")
    below.legend(*below.axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return figure


def _draw_scenarios(axes: Axes, scenarios: Mapping[str, SuccessRate]) -> None:
    rows = np.arange(len(scenarios))[::-1]
    for row, rate in zip(rows, scenarios.values(), strict=True):
        low, high = rate.interval
        axes.plot([100 * low, 100 * high], [row, row], color="#2166ac", linewidth=5, alpha=0.3)
        axes.plot(100 * rate.value, row, "o", color="#2166ac")
        axes.text(101.0, row, f"{100 * rate.value:.0f} %", va="center", fontsize=9)
        if rate.required:
            axes.plot(100 * rate.required, row, "|", color="black", markersize=13, markeredgewidth=1.6)
    axes.plot([], [], "o", color="#2166ac", label="success, with its interval of 95 %")
    axes.plot([], [], "|", color="black", markersize=13, markeredgewidth=1.6, label="required")
    least = min(50, *(10 * int(10 * rate.interval[0]) for rate in scenarios.values()))
    axes.set(xlabel="success [%]", xlim=(least, 104))
    axes.set_xticks(range(least, 101, 10))
    axes.set_yticks(rows, list(scenarios))
    axes.grid(axis="x", alpha=0.3)
    axes.legend(loc="lower left", fontsize=9)
