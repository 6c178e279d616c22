"""Chart of delay, age of the data and losses over the last minute."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import viser

from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.view.panels.html import Html, text

_PERIOD_S = 0.5
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
        self._due_s = float("-inf")
        self._missed = 0

    def draw(self, picture: ConsoleState, link_name: str, now_s: float) -> None:
        """Take a sample and draw, twice a second.

        Args:
            picture: Present state of the console.
            link_name: Name of the link, for the caption.
            now_s: Present time on the console's clock [s].
        """
        if now_s < self._due_s:
            return
        self._due_s = now_s + _PERIOD_S
        link = picture.link
        missed, self._missed = link.n_missed - self._missed, link.n_missed
        delay_s = 0.5 * link.round_trip_s if link.round_trip_s is not None else None
        self._samples.append(LinkSample(now_s, delay_s, link.age_s, max(missed, 0)))
        self._html.show(
            f'<div class="fh-lower fh-history" data-tp="history" data-missed="{link.n_missed}">'
            f'<div class="fh-caption">{text(link_name)}: <b class="fh-delay">— delay</b> '
            f'<b class="fh-age">— age</b> <b class="fh-loss">▮ missing {link.n_missed}</b></div>'
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
            (60.0, "60 s ago", ""),
            (30.0, "30 s", "fh-middle"),
            (0.0, "now", "fh-right"),
        )
    )
    return (
        f'<svg viewBox="0 0 {_WIDTH:.0f} {_HEIGHT:.0f}" preserveAspectRatio="xMidYMid meet">'
        f"{rules}{losses}{_line(ages, 'fh-age')}{_line(delays, 'fh-delay')}{ticks}</svg>"
    )


def _line(points: list[tuple[float, float]], kind: str) -> str:
    return f'<polyline points="{" ".join(f"{x:.1f},{y:.1f}" for x, y in points)}" class="{kind}"/>'
