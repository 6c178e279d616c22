"""Figures of the arm: Figs. 6 and 7 of the paper, and the success in each scenario of robustness."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse
from numpy.typing import NDArray

from farhand.common.arm.cell import Receptacle
from farhand.common.model.tphsmm import TPHSMM
from farhand.local_site.teaching.demonstration import Demonstration

Array = NDArray[np.float64]


def draw_motions(
    demonstrations: Sequence[Demonstration], model: TPHSMM, executions: Sequence[tuple[Array, bool]]
) -> Figure:
    """Draw demonstrations in the world and in the receptacle's frame, the model, and executions.

    Args:
        demonstrations: Demonstrations.
        model: Learned model.
        executions: Poses in the frame of the receptacle, and whether the execution succeeded.
    """
    figure = Figure(figsize=(12.0, 7.6), layout="constrained")
    world, local, learned, executed = figure.subplots(2, 2).flat
    for axes in (learned, executed):
        axes.sharex(local)
        axes.sharey(local)
    for demonstration in demonstrations:
        x, _, z = demonstration.position_m.T
        world.plot(x, z, linewidth=1.2)
        world.plot(*demonstration.frame_origin_m[0][[0, 2]], "kv", markersize=6)
        _plot(local, demonstration.in_frame(), linewidth=1.2)
    world.set(title="Demonstrations, world", xlabel="x [m]", ylabel="z [m]", aspect="equal")
    _draw_components(learned, model)
    for points, success in executions:
        _plot(executed, points, linewidth=1.0, color="tab:blue" if success else "tab:red")
    titles = ("Demonstrations, in the receptacle's frame", "Components (2 standard deviations)", "Executions")
    for axes, title in zip((local, learned, executed), titles, strict=True):
        bore = Receptacle()
        r, depth = bore.bore_radius_m, bore.depth_m
        axes.plot([0.0, depth, depth, 0.0], [-r, -r, r, r], color="0.4", linewidth=1.0)
        axes.set(title=title, xlabel="along the bore [m]", ylabel="beside it, x [m]", aspect="equal")
    local.set(xlim=(-0.27, 0.11), ylim=(-0.20, 0.22))
    return figure


def _plot(axes: Axes, points: Array, **how: object) -> None:
    axes.plot(points[:, 2], points[:, 0], **how)  # pyright: ignore[reportArgumentType]


def _draw_components(axes: Axes, model: TPHSMM) -> None:
    """Draw ellipses in the plane of the bore's axis and x, coloured by phase."""
    colours = matplotlib.colormaps["viridis"](0.9 * model.phase)
    for i in range(model.n_components):
        values, vectors = np.linalg.eigh(model.covariances[0, i][np.ix_([2, 0], [2, 0])])
        angle = float(np.degrees(np.arctan2(vectors[1, 1], vectors[0, 1])))
        width, height = 4.0 * np.sqrt(values[1]), 4.0 * np.sqrt(values[0])
        line = {"edgecolor": "black", "linewidth": 1.6} if model.terminal[i] else {}
        at = (float(model.means[0, i, 2]), float(model.means[0, i, 0]))
        axes.add_patch(Ellipse(at, width, height, angle=angle, facecolor=(*colours[i][:3], 0.45), **line))
        axes.annotate(str(i), at, ha="center", va="center", fontsize=8, zorder=4)
    axes.autoscale_view()


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
