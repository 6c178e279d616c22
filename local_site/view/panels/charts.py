"""Charts: delay, age of the data and losses over the last minute; the learned components with their transitions."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np
import viser

from farhand.common.model.tphsmm import TPHSMM
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.view.panels.html import Html, text
from farhand.local_site.view.panels.words.controls import (
    AGE,
    DELAY,
    GRAPH_CAPTION,
    GRAPH_EMPTY,
    GRAPH_END,
    MISSING,
    NO_MODEL,
    NOW,
)
from farhand.local_site.view.panels.words.status import ago_words
from farhand.local_site.view.scene import palette

_PERIOD_S, _DRAWN_PERIOD_S = 0.5, 2.0
"""Time between two samples, and between two drawings [s]."""
_SPAN_S = 60.0
_WIDTH, _HEIGHT, _LEFT, _RIGHT, _TOP, _BOTTOM = 330.0, 128.0, 44.0, 10.0, 12.0, 20.0
_LIMITS_S = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 60.0, 600.0)


@dataclass(frozen=True)
class LinkSample:
    """State of the link at one moment.

    Args:
        time_s: Time on the console's clock [s].
        delay_s: One-way delay, half the measured round trip [s].
        age_s: Age of the newest report [s].
        missed: Reports lost since the previous sample.
    """

    time_s: float
    delay_s: float | None
    age_s: float | None
    missed: int


class LinkHistory:
    """Chart in the lower strip. Used by the page's thread.

    Args:
        gui: GUI of the server.
    """

    def __init__(self, gui: viser.GuiApi):
        self._html = Html(gui)
        self._samples: deque[LinkSample] = deque(maxlen=round(_SPAN_S / _PERIOD_S))
        self._due_s = self._drawn_s = float("-inf")
        self._missed = 0

    def draw(self, state: ConsoleState, link_name: str, now_s: float) -> None:
        """Take a sample twice a second, and draw them all every two seconds.

        Args:
            state: Present state of the console.
            link_name: Name of the link, for the caption.
            now_s: Present time on the console's clock [s].
        """
        if now_s < self._due_s:
            return
        self._due_s = now_s + _PERIOD_S
        link = state.link
        missed, self._missed = link.n_missed - self._missed, link.n_missed
        delay_s = 0.5 * link.round_trip_s if link.round_trip_s is not None else None
        self._samples.append(LinkSample(now_s, delay_s, link.age_s, max(missed, 0)))
        if now_s - self._drawn_s < _DRAWN_PERIOD_S:
            return
        self._drawn_s = now_s
        self._html.show(
            f'<div class="fh-lower" data-tab="link" data-tp="history" data-missed="{link.n_missed}">'
            f'<div class="fh-caption">{text(link_name)}: <b class="fh-delay">— {DELAY}</b> '
            f'<b class="fh-age">— {AGE}</b> <b class="fh-loss">▮ {MISSING} {link.n_missed}</b></div>'
            f"{history_svg([s for s in self._samples if now_s - s.time_s <= _SPAN_S], now_s)}</div>"
        )


def history_svg(samples: list[LinkSample], now_s: float) -> str:
    """Return the chart: seconds upwards, the last minute from left to right."""
    largest = max([s.age_s or 0.0 for s in samples] + [s.delay_s or 0.0 for s in samples] + [0.0])
    limit_s = next((limit for limit in _LIMITS_S if limit >= 1.15 * largest), _LIMITS_S[-1])
    floor = _HEIGHT - _BOTTOM

    def x(time_s: float) -> float:
        return _WIDTH - _RIGHT - (now_s - time_s) / _SPAN_S * (_WIDTH - _LEFT - _RIGHT)

    def y(value_s: float) -> float:
        return floor - min(value_s / limit_s, 1.0) * (floor - _TOP)

    rules = "".join(
        f'<line x1="{_LEFT}" x2="{_WIDTH - _RIGHT}" y1="{y(v):.1f}" y2="{y(v):.1f}" class="fh-rule"/>'
        f'<text x="{_LEFT - 6}" y="{y(v) + 4:.1f}" class="fh-tick fh-right">{v:g} s</text>'
        for v in (0.0, 0.5 * limit_s, limit_s)
    )
    ages = [(x(s.time_s), y(s.age_s)) for s in samples if s.age_s is not None and math.isfinite(s.age_s)]
    delays = [(x(s.time_s), y(s.delay_s)) for s in samples if s.delay_s is not None]
    losses = "".join(
        f'<rect x="{x(s.time_s) - 2:.1f}" y="{floor - min(4.0 + 2.0 * s.missed, 40.0):.1f}" width="3" '
        f'height="{min(4.0 + 2.0 * s.missed, 40.0):.1f}" class="fh-bar"/>'
        for s in samples
        if s.missed
    )
    ticks = "".join(
        f'<text x="{x(now_s - back):.1f}" y="{_HEIGHT - 5}" class="fh-tick {kind}">{words}</text>'
        for back, words, kind in (
            (60.0, ago_words(60.0), ""),
            (30.0, ago_words(30.0), "fh-middle"),
            (0.0, NOW, "fh-right"),
        )
    )
    return (
        f'<svg viewBox="0 0 {_WIDTH:.0f} {_HEIGHT:.0f}" preserveAspectRatio="xMidYMid meet">'
        f"{rules}{losses}{_line(ages, 'fh-age')}{_line(delays, 'fh-delay')}{ticks}</svg>"
    )


def _line(points: list[tuple[float, float]], kind: str) -> str:
    return f'<polyline points="{" ".join(f"{x:.1f},{y:.1f}" for x, y in points)}" class="{kind}"/>'


_GRAPH_WIDTH, _GRAPH_HEIGHT, _SIDE, _GRAPH_TOP, _GRAPH_BOTTOM = 390.0, 128.0, 34.0, 20.0, 32.0
"""Least size of the drawing, and its margins [px]."""
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

    def draw(self, state: ConsoleState) -> None:
        """Show the learned or forming model, with the component that the robot executes."""
        model = state.forming or (state.learned.model if state.learned else None)
        confirmed = state.learned is not None and state.learned.sha256 == state.confirmed_sha256
        active = state.robot.component if state.robot is not None and confirmed else -1
        if self._shown is not None and self._shown[0] is model and self._shown[1] == active:
            return
        self._shown = (model, active)
        content = graph_svg(model, active) if model is not None else _EMPTY
        self._html.show(
            f'<div class="fh-lower" data-tab="model" data-tp="graph" data-active="{active}">{content}</div>'
        )


_EMPTY = f'<div class="fh-caption">{GRAPH_EMPTY}</div><div class="fh-empty">{NO_MODEL}</div>'


def graph_svg(model: TPHSMM, active: int) -> str:
    """Return the graph as SVG; components are ordered from left to right by their time in the motion."""
    places = node_places(model)
    width = max(_GRAPH_WIDTH, float(places[:, 0].max()) + _SIDE)
    height = max(_GRAPH_HEIGHT, float(places[:, 1].max()) + _GRAPH_BOTTOM)
    parts = [
        _edge(places[i], places[k], float(model.transition[i, k]))
        for i, k in zip(*np.nonzero(model.transition), strict=True)
    ]
    parts += [_node(model, index, place, index == active) for index, place in enumerate(places)]
    return (
        f'<div class="fh-caption">{GRAPH_CAPTION}</div>'
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
    x = (phase - phase.min()) / spread * (_GRAPH_WIDTH - 2.0 * _SIDE)
    n_lanes = max(model.n_paths, 1)
    lane_y = np.linspace(
        _GRAPH_TOP, max(_GRAPH_HEIGHT - _GRAPH_BOTTOM, _GRAPH_TOP + _LANE * (n_lanes - 1)), n_lanes
    )
    if n_lanes == 1:
        lane_y[:] = 0.5 * (_GRAPH_TOP + _GRAPH_HEIGHT - _GRAPH_BOTTOM)
    y, lane_end = np.zeros(model.n_components), np.full(n_lanes, -_APART)
    for index in np.argsort(x, kind="stable"):
        free = np.flatnonzero(x[index] - lane_end >= _APART)
        lane = int(free[0]) if free.size else int(np.argmin(lane_end))
        x[index] = max(x[index], lane_end[lane] + _APART)
        lane_end[lane], y[index] = x[index], lane_y[lane]
    if 0.0 < x.max() < _GRAPH_WIDTH - 2.0 * _SIDE:
        x *= (_GRAPH_WIDTH - 2.0 * _SIDE) / x.max()
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
    words = GRAPH_END if model.terminal[index] else _duration(model, index)
    return (
        (begins if model.initial[index] > 0 and not active else "")
        + f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{_RADIUS}" fill="{colour}" stroke="{ring}" '
        f'stroke-width="{4 if active else 2}"/>'
        f'<text x="{x:.1f}" y="{y + 4:.1f}" class="fh-number">{index + 1}</text>'
        f'<text x="{x:.1f}" y="{y + _RADIUS + 13:.1f}" class="fh-duration">{words}</text>'
    )


def _duration(model: TPHSMM, index: int) -> str:
    """Return a component's duration as text; empty before a demonstration has left the component."""
    mean_s, deviation_s = model.duration_mean_s[index], np.sqrt(model.duration_variance_s2[index])
    digits = 1 if max(mean_s, deviation_s) < 9.95 else 0  # never wider than `_APART` leaves room for
    return f"{mean_s:.{digits}f}±{deviation_s:.{digits}f}" if mean_s > 0.0 else ""
