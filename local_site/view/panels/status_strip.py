"""Status strip along the top: the robot's report, its age, and pending actions.

The attributes `data-tp` are a contract: tests read the page by them.
"""

from __future__ import annotations

import math

import viser
from msgspec import UNSET

from farhand.common.control_mode import ControlMode, Phase
from farhand.common.link.link_monitor import LinkHealth
from farhand.common.wire.messages import Telemetry
from farhand.common.wire.words import sentence
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.exchange.reports import PLAN_GOOD_S
from farhand.local_site.exchange.stop_sender import StopStatus
from farhand.local_site.view.panels.html import Html, element, text
from farhand.local_site.view.panels.looking_back import ago_words
from farhand.local_site.view.panels.words import Words, local_words, words_of
from farhand.local_site.view.scene.ghost import Ghost, RobotPicture, reported_tip

_LINK_WORDS = {
    LinkHealth.NEVER: "LOST",
    LinkHealth.OK: "OK",
    LinkHealth.LATE: "DEGRADED",
    LinkHealth.LOST: "LOST",
}
_HOLDERS = {ControlMode.DIRECT: "OPERATOR", ControlMode.AUTONOMOUS: "REMOTE MPC"}
_LOST_LINK = {"continue": "goes on", "hold": "pauses", "retract": "retracts"}
_AGE_STEP_S, _AGE_PERIOD_S = 0.03, 0.5
"""An age that changed by less, or was shown so shortly ago, is not shown anew."""


class StatusStrip:
    """Strip, and the cards at the lower edge of the canvas. Used by the page's thread.

    Args:
        gui: GUI of the server.
    """

    def __init__(self, gui: viser.GuiApi):
        self._strip, self._alarm, self._cards, self._frame = Html(gui), Html(gui), Html(gui), Html(gui)
        self._age_s, self._age_shown_s = 0.0, float("-inf")

    def draw(self, state: ConsoleState, picture: RobotPicture, now_s: float) -> None:
        """Show the newest state; below the robot's half what that shows.

        Args:
            state: Present state of the console.
            picture: What the robot's half shows.
            now_s: Present time on the console's clock [s].
        """
        age, words = self._age(state, now_s), words_of(state.task)
        old = " fh-strip-old" if state.link.health is not LinkHealth.OK else ""
        self._strip.show(f'<div class="fh-strip{old}">{_cells(state, age, now_s)}</div>')
        self._alarm.show(_alarm(state, picture.ghost, now_s))
        self._frame.show('<div class="fh-coupled"></div>' if state.coupled else "")
        self._cards.show(
            '<div class="fh-card fh-local"><b>YOURS</b> '
            + element("recording", "RECORDING" if state.recording else "", "fh-recording")
            + f" {local_words(state, words)}</div>"
            f'<div class="fh-card fh-remote"><b>ROBOT</b> {_remote_words(state, picture, age, words)}</div>'
        )

    def _age(self, state: ConsoleState, now_s: float) -> str:
        """Return the age of the newest report: steady while reports arrive, counting when they do not."""
        if state.link.age_s is None:
            return "unknown"
        age_s = state.link.age_s + (now_s - state.now_s)
        if abs(age_s - self._age_s) >= _AGE_STEP_S and now_s - self._age_shown_s >= _AGE_PERIOD_S:
            self._age_s, self._age_shown_s = age_s, now_s
        return f"{self._age_s:.2f} s" if state.link.health is LinkHealth.OK else f"{self._age_s:.1f} s"


def _cells(state: ConsoleState, age: str, now_s: float) -> str:
    mode = state.mode
    link = _LINK_WORDS[state.link.health]
    holder = _HOLDERS.get(mode, "NOBODY") if mode is not None else "NOBODY"
    pending = ", ".join(_pending_words(state, now_s))
    left_s = math.ceil(state.plan_received_s + PLAN_GOOD_S - now_s)
    plan = f"preview: {max(left_s, 0)} s left" if state.plan_id else ""
    learned = state.learned
    model = state.forming or (learned.model if learned else None)
    n_components = model.n_components if model else 0
    return "".join(
        (
            _cell("mode", element("mode", mode.name if mode else "UNKNOWN", f"fh-mode fh-{mode or 'unknown'}"),
                  f'<span class="fh-note">{element("phase", state.phase.upper())} {element("pace", _pace(state))}</span>'),
            _cell("in control", element("holder", holder), element("lease", _lease_words(state), "fh-note")),
            _cell("data age", element("age", age)),
            _cell("link", element("link", link, f"fh-link fh-{link.lower()}"),
                  element("silence", _silence_words(state, now_s), "fh-note")),
            _cell(_model_title(state), f"{element('components', n_components)} components",
                  f'<span class="fh-note">{element("demos", state.n_demonstrations)} demos'
                  f"{element('model', _model_words(state))}</span>"),
            _tool_cell(state.robot),
            _cell("pending", element("pending", pending or "none", "fh-busy" if pending else "fh-quiet"),
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
    return element("stop", _stop_words(stop, state, ghost, now_s), "fh-alarm", tag="div")


def _stop_words(stop: StopStatus, state: ConsoleState, ghost: Ghost | None, now_s: float) -> str:
    waited_s = math.floor(now_s - stop.pressed_s)
    if stop.moves_again:
        return f"THE ROBOT MOVES AGAIN ({stop.reported.name if stop.reported else ''}): it stood for your stop and was reset"
    if stop.standing:
        return f"STOP RECEIVED, the robot stood; it has not reported since ({waited_s} s)"
    if stop.received:
        return f"STOP RECEIVED, the robot is braking ({waited_s} s)"
    return f"STOP NOT DELIVERED {waited_s} s{_last_known(state, ghost, now_s)}"


def _last_known(state: ConsoleState, ghost: Ghost | None, now_s: float) -> str:
    """Return what the robot did when it was last heard: its present state is unknown."""
    if state.mode is None or state.link.age_s is None:
        return ""
    heard_s = math.floor(state.link.age_s + now_s - state.now_s)
    end = (
        ""
        if ghost is None
        else ", by its plan done"
        if ghost.done
        else f", by its plan done in {math.ceil(ghost.left_s)} s"
    )
    return f": the robot was {state.mode.name} when last heard {heard_s} s ago{end}"


def _pace(state: ConsoleState) -> str:
    """Return the robot's pace, if it is reduced."""
    pace = state.robot.pace if state.robot is not None else 1.0
    return f"at {pace:.0%}" if pace < 0.995 else ""


def _pending_words(state: ConsoleState, now_s: float) -> list[str]:
    words = [f"{action} {math.floor(now_s - pending.since_s)} s" for action, pending in state.pending.items()]
    return [*words, "send model"] if state.sending_model else words


def _lease_words(state: ConsoleState) -> str:
    if state.other_schema:
        return "another version"
    if state.in_control:
        return f"{state.asked_by} asks for it" if state.asked_by else "yours to command"
    return sentence(state.why_not_in_control) or "asking for the robot"


def _silence_words(state: ConsoleState, now_s: float) -> str:
    link = state.link
    if link.health is LinkHealth.OK or math.isinf(link.silent_s):
        return f"if lost: {_LOST_LINK[state.task.lost_link]}"
    return f"silent for {math.floor(link.silent_s + now_s - state.now_s)} s"


def _model_title(state: ConsoleState) -> str:
    """Return the chosen task, if there is a choice."""
    return element("task", state.task.name) if len(state.tasks) > 1 else "model"


def _model_words(state: ConsoleState) -> str:
    if state.learned is None:
        return ""
    if state.confirmed_sha256 == state.learned.sha256:
        return ", robot has it"
    if state.standing.asking:
        return ", asking the robot"
    return ", on its way" if state.sending_model else ", robot lacks it"


def _remote_words(state: ConsoleState, picture: RobotPicture, age: str, words: Words) -> str:
    robot = state.robot
    if picture.then_s is not None:
        return element("seen", f"as it was {ago_words(picture.now_s - picture.then_s)}", "fh-old")
    if robot is None:
        return "no report yet"
    if state.scene_fetching is not None:
        return f"fetching what the robot looks like, {state.scene_fetching:.0%}"
    old = state.link.health is not LinkHealth.OK
    seen = element("seen", f"OLD: seen {age} ago" if old else f"seen {age} ago", "fh-old" if old else "")
    taught = element("robot-recording", _recording_words(state), "fh-recording")
    return seen + text(_motion_words(robot, picture.ghost, words)) + _error_words(picture) + taught


def _error_words(picture: RobotPicture) -> str:
    """Return how far the ghost was from where the robot has reported to have been."""
    if picture.error_m is None:
        return ""
    return " · " + element("prediction", f"ghost {1e3 * picture.error_m:.0f} mm off")


def _recording_words(state: ConsoleState) -> str:
    """Return the progress of a demonstration that the robot records."""
    if state.recorded_s is not None:
        return f" · recording on the robot {math.floor(state.recorded_s)} s"
    return "" if state.fetching is None else f" · fetching {state.fetching:.0%}"


def _motion_words(robot: Telemetry, ghost: Ghost | None, words: Words) -> str:
    if robot.waiting:
        return " · waiting for input"
    if robot.phase.at_end:
        return f" · {robot.phase}, tracking {words.target}"
    on_way = robot.mode is ControlMode.AUTONOMOUS and robot.component < 0 and robot.phase is Phase.APPROACHING
    way = " · on the demonstrated way" if on_way else ""
    if ghost is None:
        return way
    return f"{way} · expected done" if ghost.done else f"{way} · {math.ceil(ghost.left_s)} s to go"


def _tool_cell(robot: Telemetry | None) -> str:
    """Return the force on the tool and its place in the receptacle, if the robot is an arm."""
    if robot is None or robot.arm is UNSET:
        return ""
    depth_mm = 1e3 * float(reported_tip(robot)[2])
    where = f"{depth_mm:.0f} mm deep" if depth_mm > 0.0 else f"{-depth_mm:.0f} mm away"
    return _cell("force", element("force", f"{robot.arm.force_n:.0f} N"), element("depth", where, "fh-note"))
