"""Live graph of the learned components and their transitions: the paper's Fig. 3, left, with durations."""

from __future__ import annotations

import numpy as np
import viser

from farhand.common.model.tphsmm import TPHSMM
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.view.panels.html import Html
from farhand.local_site.view.scene import palette

_WIDTH, _HEIGHT, _SIDE, _TOP, _BOTTOM = 390.0, 128.0, 34.0, 20.0, 32.0
"""The least size of the drawing and its margins [px]."""
_RADIUS = 12.0
_APART, _LANE = 46.0, 38.0
"""Least distances of two nodes beside and above each other, so that their durations do not touch [px]."""


class TransitionGraph:
    """Graph in the lower strip. Used by the page's thread.

    Args:
        gui: GUI of the server.
    """

    def __init__(self, gui: viser.GuiApi):
        self._html = Html(gui)
        self._shown: tuple[TPHSMM | None, int] | None = None

    def draw(self, picture: ConsoleState) -> None:
        """Show the learned or forming model, with the component that the robot executes."""
        model = picture.forming or (picture.learned.model if picture.learned else None)
        confirmed = picture.learned is not None and picture.learned.sha256 == picture.confirmed_sha256
        active = picture.robot.component if picture.robot is not None and confirmed else -1
        if self._shown is not None and self._shown[0] is model and self._shown[1] == active:
            return
        self._shown = (model, active)
        content = graph_svg(model, active) if model is not None else _EMPTY
        self._html.show(
            f'<div class="fh-lower fh-graph" data-tp="graph" data-active="{active}">{content}</div>'
        )


_EMPTY = '<div class="fh-caption">learned model</div><div class="fh-empty">nothing was learned yet</div>'


def graph_svg(model: TPHSMM, active: int) -> str:
    """Return the graph as SVG: from left to right by when a component is visited in the motion."""
    places = node_places(model)
    width = max(_WIDTH, float(places[:, 0].max()) + _SIDE)
    height = max(_HEIGHT, float(places[:, 1].max()) + _BOTTOM)
    parts = [
        _edge(places[i], places[k], float(model.transition[i, k]))
        for i, k in zip(*np.nonzero(model.transition), strict=True)
    ]
    parts += [_node(model, index, place, index == active) for index, place in enumerate(places)]
    return (
        f'<div class="fh-caption">learned model: components, transitions, durations [s]</div>'
        f'<svg viewBox="0 0 {width:.0f} {height:.0f}" preserveAspectRatio="xMidYMid meet">'
        '<defs><marker id="fh-tip" viewBox="0 0 8 8" refX="7" refY="4" markerUnits="userSpaceOnUse" markerWidth="9" markerHeight="9" orient="auto">'
        '<path d="M0 0 L8 4 L0 8 z" fill="#94a3b8"/></marker></defs>' + "".join(parts) + "</svg>"
    )


def node_places(model: TPHSMM) -> np.ndarray:
    """Return the place of each component, so that none covers another. Shape (K, 2) [px].

    Every path has a lane. Components that are visited at the same time, and those of a model that is only
    forming, are taken in the order in which they were learned.
    """
    phase = np.where(model.terminal, 1.0, model.phase)
    spread = max(float(np.ptp(phase)), 1e-9)
    x = (phase - phase.min()) / spread * (_WIDTH - 2.0 * _SIDE)
    n_lanes = max(model.n_paths, 1)
    lane_y = np.linspace(_TOP, max(_HEIGHT - _BOTTOM, _TOP + _LANE * (n_lanes - 1)), n_lanes)
    if n_lanes == 1:
        lane_y[:] = 0.5 * (_TOP + _HEIGHT - _BOTTOM)
    y, lane_end = np.zeros(model.n_components), np.full(n_lanes, -_APART)
    for index in np.argsort(x, kind="stable"):
        free = np.flatnonzero(x[index] - lane_end >= _APART)
        lane = int(free[0]) if free.size else int(np.argmin(lane_end))
        x[index] = max(x[index], lane_end[lane] + _APART)
        lane_end[lane], y[index] = x[index], lane_y[lane]
    if 0.0 < x.max() < _WIDTH - 2.0 * _SIDE:
        x *= (_WIDTH - 2.0 * _SIDE) / x.max()
    return np.column_stack([_SIDE + x, y])


def _edge(start: np.ndarray, end: np.ndarray, probability: float) -> str:
    way = end - start
    length = float(np.hypot(*way))
    if length < 1e-6:
        return ""
    direction = way / length
    bend = 0.12 * length * np.array([-direction[1], direction[0]])
    a, b, middle = start + direction * _RADIUS, end - direction * (_RADIUS + 2.0), 0.5 * (start + end) + bend
    return (
        f'<path d="M{a[0]:.1f} {a[1]:.1f} Q{middle[0]:.1f} {middle[1]:.1f} {b[0]:.1f} {b[1]:.1f}" fill="none" '
        f'stroke="#94a3b8" stroke-width="{0.8 + 2.0 * probability:.2f}" marker-end="url(#fh-tip)"/>'
    )


def _node(model: TPHSMM, index: int, place: np.ndarray, active: bool) -> str:
    x, y = place
    colour = palette.css(palette.component_colour(float(model.phase[index])))
    ring = "#ffffff" if active else ("#cbd5e1" if model.terminal[index] else "none")
    begins = f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{_RADIUS + 3.5}" fill="none" stroke="#f87171"/>'
    words = "end" if model.terminal[index] else _duration(model, index)
    return (
        (begins if model.initial[index] > 0 and not active else "")
        + f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{_RADIUS}" fill="{colour}" stroke="{ring}" '
        f'stroke-width="{4 if active else 2}"/>'
        f'<text x="{x:.1f}" y="{y + 4:.1f}" class="fh-number">{index + 1}</text>'
        f'<text x="{x:.1f}" y="{y + _RADIUS + 13:.1f}" class="fh-duration">{words}</text>'
    )


def _duration(model: TPHSMM, index: int) -> str:
    """Return a component's duration as text; nothing before it has been left once."""
    mean_s, deviation_s = model.duration_mean_s[index], np.sqrt(model.duration_variance_s2[index])
    digits = 1 if max(mean_s, deviation_s) < 9.95 else 0  # never wider than `_APART` leaves room for
    return f"{mean_s:.{digits}f}±{deviation_s:.{digits}f}" if mean_s > 0.0 else ""
