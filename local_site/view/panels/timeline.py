"""Timeline of the last two minutes: mode, component, force with its limit, depth and age of the data on one axis."""

from __future__ import annotations

import itertools
import math
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import viser
from msgspec import UNSET

from farhand.common.link.link_monitor import LinkHealth
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.view.panels.html import Html, text
from farhand.local_site.view.scene.ghost import reported_tip

_PERIOD_S, _SPAN_S = 1.0, 120.0
_WIDTH, _HEIGHT, _LEFT, _RIGHT = 760.0, 108.0, 44.0, 8.0
_MODE_Y, _COMPONENT_Y, _LANE, _PLOTS_Y = 1.0, 16.0, 14.0, 33.0
_FLOOR_Y = 93.0
_LIMITS = (0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 400.0, 1000.0)


@dataclass(frozen=True)
class Moment:
    """Report of the robot, and its age, at one moment.

    Args:
        time_s: Time on the console's clock [s].
        mode: Name of the mode with its phase; empty before the first report.
        component: Component in execution; -1 for none.
        force_n: Force on the tool [N]; None without an arm.
        depth_mm: Depth of the tool in the receptacle [mm]; None without an arm.
        age_s: Age of the report [s]; None while unknown.
        heard: False during an outage: what is shown of the robot is old.
    """

    time_s: float
    mode: str
    component: int
    force_n: float | None
    depth_mm: float | None
    age_s: float | None
    heard: bool


def moment(state: ConsoleState, now_s: float) -> Moment:
    """Return what the timeline keeps of a state."""
    robot = state.robot
    arm = robot.arm if robot is not None else UNSET
    age_s = state.link.age_s
    return Moment(
        time_s=now_s,
        mode=f"{robot.mode.name} {robot.phase}".strip() if robot is not None else "",
        component=robot.component if robot is not None else -1,
        force_n=arm.force_n if arm is not UNSET else None,
        depth_mm=1e3 * float(reported_tip(robot)[2]) if robot is not None and arm is not UNSET else None,
        age_s=age_s + now_s - state.now_s if age_s is not None and math.isfinite(age_s) else None,
        heard=robot is None or state.link.health is LinkHealth.OK,
    )


class Timeline:
    """Panel with the timeline. Used by the page's thread.

    Args:
        gui: GUI of the server.
    """

    def __init__(self, gui: viser.GuiApi):
        self._html = Html(gui)
        self._moments: deque[Moment] = deque(maxlen=round(_SPAN_S / _PERIOD_S) + 1)
        self._due_s = float("-inf")

    def draw(self, state: ConsoleState, now_s: float) -> None:
        """Take a moment and draw, once a second."""
        if now_s < self._due_s:
            return
        self._due_s = now_s + _PERIOD_S
        self._moments.append(moment(state, now_s))
        limit_n = state.task.limits.force_n
        self._html.show(
            '<div class="fh-lower" data-tab="timeline" data-tp="timeline">'
            f"{timeline_svg(list(self._moments), now_s, limit_n)}</div>"
        )


def timeline_svg(moments: Sequence[Moment], now_s: float, force_limit_n: float) -> str:
    """Return the timeline as SVG: lanes for mode and component, plots for force, depth and age.

    Args:
        moments: What is known of each moment, the newest last.
        now_s: Right end of the axis [s].
        force_limit_n: Limit of the force of the task [N].
    """
    plots = [_Plot("age", "s", [(m.time_s, m.age_s) for m in moments])]
    if any(m.force_n is not None for m in moments):
        plots.insert(0, _Plot("depth", "mm", [(m.time_s, m.depth_mm) for m in moments], signed=True))
        plots.insert(0, _Plot("force", "N", [(m.time_s, m.force_n) for m in moments], limit=force_limit_n))
    height = (_FLOOR_Y - _PLOTS_Y) / len(plots)
    parts = [_outages(moments, now_s)]
    parts += _lane(
        "mode", _MODE_Y, moments, now_s, lambda m: m.mode if m.heard or not m.mode else f"{m.mode} (old)"
    )
    parts += _lane(
        "part", _COMPONENT_Y, moments, now_s, lambda m: str(m.component + 1) if m.component >= 0 else ""
    )
    parts += [plot.svg(_PLOTS_Y + number * height, height - 4.0, now_s) for number, plot in enumerate(plots)]
    ticks = (_x(now_s - back, now_s) for back in (120.0, 90.0, 60.0, 30.0, 0.0))
    names = ("2 min ago", "90 s", "60 s", "30 s", "now")
    kinds = ("", "fh-middle", "fh-middle", "fh-middle", "fh-right")
    parts += [
        f'<text x="{x:.0f}" y="{_HEIGHT - 3:.0f}" class="fh-tick {kind}">{name}</text>'
        for x, name, kind in zip(ticks, names, kinds, strict=True)
    ]
    return (
        f'<svg viewBox="0 0 {_WIDTH:.0f} {_HEIGHT:.0f}" preserveAspectRatio="xMidYMid meet" role="img" '
        f'aria-label="Timeline of the last two minutes">{"".join(parts)}</svg>'
    )


def _x(time_s: float, now_s: float) -> float:
    return _WIDTH - _RIGHT - min((now_s - time_s) / _SPAN_S, 1.0) * (_WIDTH - _LEFT - _RIGHT)


def _outages(moments: Sequence[Moment], now_s: float) -> str:
    """Return a shade over each stretch in which nothing, or only old reports, were heard."""
    shades = []
    for heard, stretch in itertools.groupby(_spans(moments, now_s), key=lambda span: span[2].heard):
        spans = list(stretch)
        if not heard:
            left, right = _x(spans[0][0], now_s), _x(spans[-1][1], now_s)
            shades.append(
                f'<rect x="{left:.1f}" y="0" width="{max(right - left, 1.0):.1f}" height="{_FLOOR_Y}" class="fh-outage"/>'
            )
    return "".join(shades)


def _spans(moments: Sequence[Moment], now_s: float) -> list[tuple[float, float, Moment]]:
    """Return each moment with the time from which and until which it holds [s]."""
    ends = [*(m.time_s for m in moments[1:]), now_s]
    return [(m.time_s, end, m) for m, end in zip(moments, ends, strict=True)]


def _lane(
    name: str, top: float, moments: Sequence[Moment], now_s: float, words_of: Callable[[Moment], str]
) -> list[str]:
    """Return a lane of stretches with equal words."""
    parts = [f'<text x="{_LEFT - 6:.0f}" y="{top + 11:.0f}" class="fh-tick fh-right">{name}</text>']
    for words, stretch in itertools.groupby(_spans(moments, now_s), key=lambda span: words_of(span[2])):
        spans = list(stretch)
        left, right = _x(spans[0][0], now_s), _x(spans[-1][1], now_s)
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

    def svg(self, top: float, height: float, now_s: float) -> str:
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
            limit = f'<text x="{_LEFT + 3}" y="{top + 9:.0f}" class="fh-tick">limit {self.limit:g} {self.unit}</text>'
        now = f"{known[-1][1]:.3g} {self.unit}" if known else ""
        zero = y(0.0)
        points = " ".join(f"{_x(t, now_s):.0f},{y(value):.1f}" for t, value in _thinned(known))
        middle = top + 0.5 * height + 4.0
        return (
            f'<line x1="{_LEFT}" x2="{_WIDTH - _RIGHT}" y1="{zero:.1f}" y2="{zero:.1f}" class="fh-rule"/>'
            f'<text x="{_LEFT - 6:.0f}" y="{middle:.0f}" class="fh-tick fh-right">{self.name}</text>'
            f'{limit}<polyline points="{points}" class="fh-curve fh-{self.name}"><title>{self.name} {now}</title></polyline>'
        )


def _thinned(points: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Leave out the points between equal ones: at rest hardly anything is sent."""
    return [
        point
        for k, point in enumerate(points)
        if k in (0, len(points) - 1)
        or abs(points[k - 1][1] - point[1]) + abs(points[k + 1][1] - point[1]) > 0.01
    ]
