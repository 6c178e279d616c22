"""Figs. 6 and 7 of the paper: demonstrations, model and executions of an insertion."""

from __future__ import annotations

from collections.abc import Sequence

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse
from numpy.typing import NDArray

from farhand.common.arm.dimensions import Dimensions
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
        bore = Dimensions().receptacle
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
