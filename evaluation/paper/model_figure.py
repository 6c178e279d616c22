"""Figure of a model like the paper's Fig. 3: components in the task frame, transitions, durations."""

from __future__ import annotations

from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse
from numpy.typing import ArrayLike

from farhand.common.errors import InvalidConfiguration
from farhand.common.model.tphsmm import TPHSMM
from farhand.evaluation.metrics.tables import write_figure

_FILES = (".png", ".pdf", ".svg")


def draw_model(model: TPHSMM, file: Path) -> None:
    """Draw a model in its first task frame.

    On the left its components and transitions in the plane of the first two dimensions, on the right the
    duration of each component. Components count from one, as on the page.

    Args:
        model: Learned model.
        file: A .png, .pdf or .svg file.

    Raises:
        InvalidConfiguration: When the file is of another kind.
        OSError: When it cannot be written; its content is unchanged.
    """
    if file.suffix not in _FILES:
        raise InvalidConfiguration(
            "command line", "figure", f"a file ending in {', '.join(_FILES)}, got {file}"
        )
    figure = Figure(figsize=(10.0, 4.6), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.2, 1.0))
    colours = matplotlib.colormaps["viridis"](0.9 * model.phase)
    _draw_components(left, model)
    _draw_durations(right, model, colours)
    write_figure(figure, file, dpi=160)


def draw_components(axes: Axes, model: TPHSMM, origin: ArrayLike = 0.0) -> None:
    """Draw ellipses of two standard deviations in the plane of the first two dimensions, coloured by phase.

    Args:
        axes: Axes to draw into.
        model: Learned model.
        origin: Origin of its first task frame, which is not rotated [m]. Shape (2,).
    """
    means, covariances = (
        model.means[0, :, :2] + np.asarray(origin, dtype=float),
        model.covariances[0, :, :2, :2],
    )
    colours = matplotlib.colormaps["viridis"](0.9 * model.phase)
    for i, (mean, covariance) in enumerate(zip(means, covariances, strict=True)):
        values, vectors = np.linalg.eigh(covariance)
        angle = np.degrees(np.arctan2(vectors[1, 1], vectors[0, 1]))
        width, height = 4.0 * np.sqrt(values[1]), 4.0 * np.sqrt(values[0])  # two standard deviations
        line = {"edgecolor": "black", "linewidth": 1.6} if model.terminal[i] else {}
        axes.add_patch(
            Ellipse(tuple(mean), width, height, angle=angle, facecolor=(*colours[i][:3], 0.45), **line)
        )
        axes.annotate(str(i + 1), tuple(mean), ha="center", va="center", fontsize=9, zorder=4)


def _draw_components(axes: Axes, model: TPHSMM) -> None:
    means = model.means[0, :, :2]
    draw_components(axes, model)
    for i, k in zip(*np.nonzero(model.transition), strict=True):
        arrow = {"arrowstyle": "-|>", "color": "0.25", "shrinkA": 9, "shrinkB": 9,
                 "linewidth": 0.6 + 1.6 * model.transition[i, k], "connectionstyle": "arc3,rad=0.12"}  # fmt: skip
        axes.annotate("", tuple(means[k]), tuple(means[i]), arrowprops=arrow, zorder=3)
    starts = means[model.initial > 0]
    axes.scatter(
        *starts.T, s=320, facecolor="none", edgecolor="tab:red", label="a demonstration began", zorder=3
    )
    axes.plot(0.0, 0.0, "k+", markersize=12, label=f"frame {model.frame_names[0]}")
    axes.set(
        aspect="equal",
        xlabel="x [m]",
        ylabel="y [m]",
        title="Components (2 standard deviations), transitions",
    )
    axes.autoscale_view()
    axes.margins(0.08)
    axes.legend(loc="best", fontsize=8)


def _draw_durations(axes: Axes, model: TPHSMM, colours: np.ndarray) -> None:
    moving = np.flatnonzero(~model.terminal)
    means, deviations = model.duration_mean_s[moving], np.sqrt(model.duration_variance_s2[moving])
    time_s = np.linspace(0.0, float((means + 4.0 * deviations).max()), 400)
    for i, mean, deviation in zip(moving, means, deviations, strict=True):
        density = np.exp(-0.5 * ((time_s - mean) / deviation) ** 2)
        axes.fill_between(time_s, density, alpha=0.25, color=colours[i])
        axes.plot(time_s, density, color=colours[i])
        axes.annotate(str(i + 1), (mean, 1.02), ha="center", fontsize=9)
    axes.set(
        xlabel="duration [s]",
        ylabel="relative probability",
        title="Duration of each component",
        ylim=(0, 1.12),
    )
