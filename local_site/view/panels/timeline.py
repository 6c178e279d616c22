"""Timeline of this session: mode, component, force with its limit, depth and age of the data on one axis."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import viser

from farhand.local_site.view.history import History, Moment
from farhand.local_site.view.panels.html import Html, text
from farhand.local_site.view.panels.looking_back import Look
from farhand.local_site.view.panels.words.controls import LANES, LIMIT, NOW, OLD, TIMELINE
from farhand.local_site.view.panels.words.status import ago_words

_PERIOD_S, _AT_REST_S = 1.0, 2.0
"""Time between two drawings, and the same while the robot's half only grows older [s]."""
_COLUMNS = 240
"""Most points of a curve: of the moments between two of them, the one with the largest force is drawn."""
_WIDTH, _HEIGHT, _LEFT, _RIGHT = 760.0, 108.0, 44.0, 8.0
_MODE_Y, _COMPONENT_Y, _LANE, _PLOTS_Y = 1.0, 16.0, 14.0, 33.0
_FLOOR_Y = 93.0
_LIMITS = (0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 400.0, 1000.0)


class Timeline:
    """Panel with the timeline. Used by the page's thread.

    Args:
        gui: GUI of the server.
    """

    def __init__(self, gui: viser.GuiApi):
        self._html = Html(gui)
        self._drawn_s = float("-inf")
        self._shown: Look | None = None
        self._facts: tuple[str, int, bool] | None = None

    def draw(self, history: History, look: Look, force_limit_n: float, now_s: float) -> None:
        """Draw once a second, less often at rest, and at once where the operator looks at another moment.

        Args:
            history: Moments of this session.
            look: Span of the axis, and the moment that is looked at.
            force_limit_n: Limit of the force of the task [N].
            now_s: Present time on the console's clock [s].
        """
        newest = history.newest
        facts = (newest.mode, newest.component, newest.heard) if newest is not None else None
        period_s = _AT_REST_S if facts == self._facts and not (newest and newest.executes) else _PERIOD_S
        if now_s - self._drawn_s < period_s and look == self._shown:
            return
        self._drawn_s, self._shown, self._facts = now_s, look, facts
        svg = timeline_svg(history.since(now_s - look.span_s), now_s, force_limit_n, look)
        self._html.show(f'<div class="fh-lower" data-tab="timeline" data-tp="timeline">{svg}</div>')


def timeline_svg(
    moments: Sequence[Moment], now_s: float, force_limit_n: float, look: Look | None = None
) -> str:
    """Return the timeline as SVG: lanes for mode and component, plots for force, depth and age.

    Args:
        moments: What is known of each moment, the newest last.
        now_s: Right end of the axis [s].
        force_limit_n: Limit of the force of the task [N].
        look: Span of the axis, and the moment that is looked at.
    """
    look = look or Look()
    axis, drawn = _Axis(now_s, look.span_s), _columns(moments, look.span_s)
    plots = [_Plot(LANES["age"], "s", [(m.time_s, m.age_s) for m in drawn])]
    if any(m.force_n is not None for m in drawn):
        plots.insert(0, _Plot(LANES["depth"], "mm", [(m.time_s, m.depth_mm) for m in drawn], signed=True))
        plots.insert(
            0, _Plot(LANES["force"], "N", [(m.time_s, m.force_n) for m in drawn], limit=force_limit_n)
        )
    height = (_FLOOR_Y - _PLOTS_Y) / len(plots)
    parts = [_outages(moments, axis)]
    parts += _lane(
        "mode", _MODE_Y, moments, axis, lambda m: m.mode if m.heard or not m.mode else f"{m.mode} ({OLD})"
    )
    parts += _lane(
        "part", _COMPONENT_Y, moments, axis, lambda m: str(m.component + 1) if m.component >= 0 else ""
    )
    parts += [plot.svg(_PLOTS_Y + number * height, height - 4.0, axis) for number, plot in enumerate(plots)]
    parts += axis.ticks()
    if look.then_s is not None:
        x = axis.x(look.then_s)
        parts.append(f'<line x1="{x:.1f}" x2="{x:.1f}" y1="0" y2="{_FLOOR_Y}" class="fh-then"/>')
    return (
        f'<svg viewBox="0 0 {_WIDTH:.0f} {_HEIGHT:.0f}" preserveAspectRatio="xMidYMid meet" role="img" '
        f'data-left="{_LEFT}" data-right="{_WIDTH - _RIGHT}" data-span="{look.span_s:g}" '
        f'aria-label="{TIMELINE.format(ago_words(look.span_s))}">{"".join(parts)}</svg>'
    )


@dataclass(frozen=True)
class _Axis:
    """Axis of time, which ends now."""

    now_s: float
    span_s: float

    def x(self, time_s: float) -> float:
        part = min(max((self.now_s - time_s) / self.span_s, 0.0), 1.0)
        return _WIDTH - _RIGHT - part * (_WIDTH - _LEFT - _RIGHT)

    def ticks(self) -> list[str]:
        """Return the names of five moments on the axis."""
        words = []
        for part, kind in zip((1.0, 0.75, 0.5, 0.25, 0.0), ("", *["fh-middle"] * 3, "fh-right"), strict=True):
            name = ago_words(part * self.span_s) if part else NOW
            x = self.x(self.now_s - part * self.span_s)
            words.append(f'<text x="{x:.0f}" y="{_HEIGHT - 3:.0f}" class="fh-tick {kind}">{name}</text>')
        return words


def _columns(moments: Sequence[Moment], span_s: float) -> list[Moment]:
    """Return at most one moment of each column of the drawing, that of the largest force: no peak is left out."""
    columns = itertools.groupby(moments, key=lambda m: int(m.time_s * _COLUMNS / span_s))
    return [max(column, key=lambda m: m.force_n or 0.0) for _, column in columns]


def _outages(moments: Sequence[Moment], axis: _Axis) -> str:
    """Return a shade over each stretch in which nothing, or only old reports, were heard."""
    shades = []
    for heard, stretch in itertools.groupby(_spans(moments, axis.now_s), key=lambda span: span[2].heard):
        spans = list(stretch)
        if not heard:
            left, right = axis.x(spans[0][0]), axis.x(spans[-1][1])
            shades.append(
                f'<rect x="{left:.1f}" y="0" width="{max(right - left, 1.0):.1f}" height="{_FLOOR_Y}" class="fh-outage"/>'
            )
    return "".join(shades)


def _spans(moments: Sequence[Moment], now_s: float) -> list[tuple[float, float, Moment]]:
    """Return each moment with the time from which and until which it holds [s]."""
    ends = [*(m.time_s for m in moments[1:]), now_s][: len(moments)]
    return [(m.time_s, end, m) for m, end in zip(moments, ends, strict=True)]


def _lane(
    name: str, top: float, moments: Sequence[Moment], axis: _Axis, words_of: Callable[[Moment], str]
) -> list[str]:
    """Return a lane of stretches with equal words."""
    parts = [f'<text x="{_LEFT - 6:.0f}" y="{top + 11:.0f}" class="fh-tick fh-right">{LANES[name]}</text>']
    for words, stretch in itertools.groupby(_spans(moments, axis.now_s), key=lambda span: words_of(span[2])):
        spans = list(stretch)
        left, right = axis.x(spans[0][0]), axis.x(spans[-1][1])
        if not words:
            continue
        kind = f"fh-lane-{spans[0][2].mode.partition(' ')[0].lower()}" if name == "mode" else "fh-lane"
        parts.append(
            f'<rect x="{left:.1f}" y="{top}" width="{max(right - left - 1.0, 1.0):.1f}" height="{_LANE}" class="{kind}"/>'
        )
        if right - left > 9.0 * len(words) + 6.0:
            parts.append(
                f'<text x="{left + 4:.1f}" y="{top + 11:.0f}" class="fh-lane-words">{text(words)}</text>'
            )
    return parts


@dataclass(frozen=True)
class _Plot:
    """Curve over time with its own scale."""

    name: str
    unit: str
    points: list[tuple[float, float | None]]
    limit: float | None = None
    signed: bool = False

    def svg(self, top: float, height: float, axis: _Axis) -> str:
        known = [(t, value) for t, value in self.points if value is not None]
        largest = max((abs(value) for _, value in known), default=0.0)
        full = next((each for each in _LIMITS if each >= largest), _LIMITS[-1])
        low = -full if self.signed else 0.0

        def y(value: float) -> float:
            return top + height * (1.0 - (min(max(value, low), full) - low) / (full - low))

        limit = ""
        if self.limit is not None and self.limit <= full:
            at = y(self.limit)
            limit = (
                f'<line x1="{_LEFT}" x2="{_WIDTH - _RIGHT}" y1="{at:.1f}" y2="{at:.1f}" class="fh-limit"/>'
            )
        elif self.limit is not None:
            limit = f'<text x="{_LEFT + 3}" y="{top + 9:.0f}" class="fh-tick">{LIMIT} {self.limit:g} {self.unit}</text>'
        now = f"{known[-1][1]:.3g} {self.unit}" if known else ""
        zero = y(0.0)
        points = " ".join(f"{axis.x(t):.0f},{y(value):.1f}" for t, value in _thinned(known))
        middle = top + 0.5 * height + 4.0
        return (
            f'<line x1="{_LEFT}" x2="{_WIDTH - _RIGHT}" y1="{zero:.1f}" y2="{zero:.1f}" class="fh-rule"/>'
            f'<text x="{_LEFT - 6:.0f}" y="{middle:.0f}" class="fh-tick fh-right">{self.name}</text>'
            f'<polyline points="{points}" class="fh-curve fh-{self.name}"><title>{self.name} {now}</title></polyline>{limit}'
        )


def _thinned(points: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Leave out the points between equal ones: at rest hardly anything is sent."""
    return [
        point
        for k, point in enumerate(points)
        if k in (0, len(points) - 1)
        or abs(points[k - 1][1] - point[1]) + abs(points[k + 1][1] - point[1]) > 0.01
    ]
