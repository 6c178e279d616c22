"""Status strip along the top: the robot's report, its age, and pending actions.

The attributes `data-tp` are a contract: tests read the page by them.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import viser
from msgspec import UNSET

from farhand.common.wire.messages import Telemetry
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.exchange.report_age import LinkHealth
from farhand.local_site.exchange.reports import PLAN_GOOD_S
from farhand.local_site.view.panels.html import Html, element, text
from farhand.local_site.view.panels.words.controls import CELLS, RECORDING, ROBOTS, YOURS
from farhand.local_site.view.panels.words.status import (
    HOLDERS,
    LINK_WORDS,
    NO_PENDING,
    NO_REPORT,
    NOBODY,
    UNKNOWN,
    as_it_was_words,
    counted,
    depth_words,
    error_words,
    fetching_words,
    lease_words,
    left_words,
    model_words,
    motion_words,
    pace_words,
    pending_words,
    recording_words,
    seen_words,
    silence_words,
    stop_does_words,
    stop_words,
)
from farhand.local_site.view.panels.words.tasks import TaskWords, local_words, words_of
from farhand.local_site.view.scene.ghost import Ghost, RobotPicture, reported_tip

_AGE_STEP_S, _AGE_PERIOD_S = 0.07, 0.5
"""An age is shown to 0.1 s; one that changed by less than this, or was shown so shortly ago, stays as it is."""
_SEEN_MM, _NEAR_MM = 4.0, 30.0
"""A distance from the mouth that changed by less is the tracker's noise, unless the plug is as near to the mouth as this."""


class StatusStrip:
    """Strip, and the cards at the lower edge of the canvas. Used by the page's thread.

    Args:
        gui: GUI of the server.
        warning: Returns what is wrong with the link's security, empty if nothing is.
    """

    def __init__(self, gui: viser.GuiApi, warning: Callable[[], str] = lambda: ""):
        self._warning = warning
        self._strip, self._alarm, self._cards, self._frame = Html(gui), Html(gui), Html(gui), Html(gui)
        self._age_s, self._age_shown_s = 0.0, float("-inf")
        self._depth_mm = 0.0

    def draw(self, state: ConsoleState, picture: RobotPicture, now_s: float) -> None:
        """Show the newest state; below the robot's half what that shows.

        Args:
            state: Present state of the console.
            picture: What the robot's half shows.
            now_s: Present time on the console's clock [s].
        """
        age, words = self._age(state, now_s), words_of(state.task)
        old = " fh-strip-old" if state.link.health is not LinkHealth.OK else ""
        self._strip.show(
            f'<div class="fh-strip{old}">{_cells(state, age, self._depth(state.robot), now_s, self._warning())}</div>'
            + element("stop-does", stop_does_words(state), hidden="")
        )
        self._alarm.show(_alarm(state, picture.ghost, now_s))
        self._frame.show('<div class="fh-coupled"></div>' if state.coupled else "")
        self._cards.show(
            f'<div class="fh-card fh-local"><b>{YOURS}</b> '
            + element("recording", RECORDING if state.recording else "", "fh-recording")
            + f" {local_words(state, words)}</div>"
            f'<div class="fh-card fh-remote"><b>{ROBOTS}</b> {_remote_words(state, picture, age, words)}</div>'
        )

    def _age(self, state: ConsoleState, now_s: float) -> str:
        """Return the age of the newest report: steady while reports arrive, counting when they do not."""
        if state.link.age_s is None:
            return UNKNOWN.lower()
        age_s = state.link.age_s + (now_s - state.now_s)
        if abs(age_s - self._age_s) >= _AGE_STEP_S and now_s - self._age_shown_s >= _AGE_PERIOD_S:
            self._age_s, self._age_shown_s = age_s, now_s
        return f"{self._age_s:.1f} s"

    def _depth(self, robot: Telemetry | None) -> float | None:
        """Return the depth of the robot's plug to show [mm]: steady while only noise changes it; None without an arm."""
        if robot is None or robot.arm is UNSET:
            return None
        depth_mm = 1e3 * float(reported_tip(robot)[2])
        if depth_mm > -_NEAR_MM or abs(depth_mm - self._depth_mm) >= _SEEN_MM:
            self._depth_mm = depth_mm
        return self._depth_mm


def _cells(state: ConsoleState, age: str, depth_mm: float | None, now_s: float, warning: str) -> str:
    mode = state.mode
    link = LINK_WORDS[state.link.health]
    holder = HOLDERS.get(mode, NOBODY) if mode is not None else NOBODY
    pending = ", ".join(pending_words(state, now_s))
    left_s = math.ceil(state.plan_received_s + PLAN_GOOD_S - now_s)
    plan = left_words(left_s) if state.plan_id else ""
    learned = state.learned
    model = state.forming or (learned.model if learned else None)
    n_components = model.n_components if model else 0
    return "".join(
        (
            _cell(CELLS["mode"], element("mode", mode.name if mode else UNKNOWN, f"fh-mode fh-{mode or 'unknown'}"),
                  f'<span class="fh-note">{element("phase", state.phase.upper())} {element("pace", pace_words(state))}</span>'),
            _cell(CELLS["control"], element("holder", holder), element("lease", lease_words(state), "fh-note")),
            _cell(CELLS["age"], element("age", age)),
            _cell(CELLS["link"], element("link", link, f"fh-link fh-{link.lower()}"),
                  f'<span class="fh-note">{element("security", warning, "fh-insecure", title=warning) if warning else ""}'
                  f'{element("silence", silence_words(state, now_s))}</span>'),
            _cell(_model_title(state), f"{element('components', n_components)}{counted(n_components, ' component')}",
                  f'<span class="fh-note">{element("demos", state.n_demonstrations)}{counted(state.n_demonstrations, " demo")}'
                  f"{element('model', model_words(state))}</span>"),
            _tool_cell(state.robot, depth_mm),
            _cell(CELLS["pending"], element("pending", pending or NO_PENDING, "fh-busy" if pending else "fh-quiet"),
                  element("plan", plan, "fh-note")),
        )
    )  # fmt: skip


def _cell(title: str, content: str, note: str = "") -> str:
    return f'<div class="fh-cell"><i>{title}</i><div>{content}</div>{note}</div>'


def _alarm(state: ConsoleState, ghost: Ghost | None, now_s: float) -> str:
    """Return the alarm about a stop that the robot has not confirmed, or that a site has undone."""
    stop = state.stop
    if stop is None or stop.settled:
        return element("stop", "", "fh-no-alarm", tag="div")
    return element("stop", stop_words(stop, state, ghost, now_s), "fh-alarm", tag="div")


def _model_title(state: ConsoleState) -> str:
    """Return the chosen task, if there is a choice."""
    return element("task", state.task.name) if len(state.tasks) > 1 else CELLS["model"]


def _remote_words(state: ConsoleState, picture: RobotPicture, age: str, words: TaskWords) -> str:
    robot = state.robot
    if picture.then_s is not None:
        return element("seen", as_it_was_words(picture.now_s - picture.then_s), "fh-old")
    if robot is None:
        return NO_REPORT
    if state.scene_fetching is not None and state.robot_scene is None:
        return fetching_words(state.scene_fetching)
    old = state.link.health is not LinkHealth.OK
    seen = element("seen", seen_words(age, old), "fh-old" if old else "")
    taught = element("robot-recording", recording_words(state), "fh-recording")
    return seen + text(motion_words(robot, picture.ghost, words)) + _error(picture) + taught


def _error(picture: RobotPicture) -> str:
    words = error_words(picture)
    return f" · {element('prediction', words)}" if words else ""


def _tool_cell(robot: Telemetry | None, depth_mm: float | None) -> str:
    """Return the force on the tool and its place in the receptacle, if the robot is an arm."""
    if robot is None or robot.arm is UNSET or depth_mm is None:
        return ""
    return _cell(
        CELLS["force"],
        element("force", f"{robot.arm.force_n:.0f} N"),
        element("depth", depth_words(depth_mm), "fh-note"),
    )
