"""An operator by script: does the whole job through the same intents as a person at the page.

Demonstrates, sends, arms, couples and drives a little, clutches, previews, executes, and measures.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from common.control_mode import Action, ControlMode, Phase
from common.errors import FarhandError
from common.messages import ExecutionReport
from common.path_points import duration_s
from common.task import PointTask
from local_site import intents
from local_site.operators_place import CuttableLink, OperatedConsole, OperatorsTime, PlannedOutage, RealTime
from local_site.picture import Picture
from local_site.samples import sample_strokes

_log = logging.getLogger(__name__)

_PATIENCE_S = 60.0
_TRACKING_S = 10.0
_DRIVE_S = 1.5
_HAND_PERIOD_S = 1.0 / 30.0
_ATTEMPTS = 3


class JobFailed(FarhandError):
    """The scripted job could not go on; says at which step and why."""


class ScriptedOperator:
    """Does the job once.

    Args:
        console: The operator's console.
        task: The task.
        control: The link process, to cut the link; None when there is none.
        outage: The cut, or None.
        seed: Of the hand's tremor.
        time: The operator's.
    """

    def __init__(
        self,
        console: OperatedConsole,
        task: PointTask,
        control: CuttableLink | None,
        outage: PlannedOutage | None,
        seed: int,
        time: OperatorsTime | None = None,
    ):
        self._console, self._task, self._control = console, task, control
        self._outage, self._seed = outage, seed
        self._time = time or RealTime()
        self._began_s = self._time.now_s()
        self._events: list[dict[str, Any]] = []

    def run(self) -> dict[str, Any]:
        """The whole job.

        Returns:
            What happened, as `farhand demo --json` writes it.

        Raises:
            JobFailed: When a step did not come to its end.
        """
        self._demonstrate()
        self._send_model()
        self._command(Action.ARM, ControlMode.HOLD)
        self._drive()
        self._command(Action.CLUTCH, ControlMode.HOLD)
        self._preview()
        self._command(Action.EXECUTE, ControlMode.AUTONOMOUS)
        if self._outage is not None:
            self._cut(self._outage)
        report = self._measure()
        self._command(Action.CLUTCH, ControlMode.HOLD)
        self._command(Action.DISARM, ControlMode.DISARMED)
        return self._result(report)

    # Steps --------------------------------------------------------------------------------------

    def _demonstrate(self) -> None:
        self._console.submit(intents.StartAnew())
        for number, stroke in enumerate(sample_strokes(self._task, self._seed), start=1):
            self._console.submit(intents.Record())
            for position, time_s in zip(stroke.position_m, stroke.time_s, strict=True):
                self._console.submit(intents.Hand(tuple(position.tolist()), float(time_s)))
            self._console.submit(intents.End())
            self._await(
                f"demonstration {number}", lambda p, n=number: p.n_demonstrations == n and not p.recording
            )
            learned = self._console.picture.learned
            assert learned is not None
            n = int((~learned.model.terminal).sum())
            self._say(f"demonstration {number} of {len(self._task.samples)}: {n} components")

    def _send_model(self) -> None:
        learned = self._console.picture.learned
        if learned is None:
            raise JobFailed("the task has no samples to demonstrate")
        self._console.submit(intents.SendModel())
        self._await("confirmation of the model", lambda p: p.confirmed_sha256 == learned.sha256)
        self._say(f"model {learned.sha256[:8]}, {len(learned.content)} B, confirmed by the robot")

    def _command(self, action: Action, mode: ControlMode) -> None:
        """Give a command and wait for the robot's own report; try again, as a person would."""
        self._await("control of the robot", lambda p: p.in_control)
        for attempt in range(1, _ATTEMPTS + 1):
            n_answers = len(self._console.picture.command_round_trips_s)
            n_refusals = self._refusals(action, self._console.picture)

            def done(p: Picture, n: int = n_answers) -> bool:
                return len(p.command_round_trips_s) > n and p.mode is mode

            def over(p: Picture, n: int = n_refusals) -> bool:
                return done(p) or self._refusals(action, p) > n

            self._console.submit(intents.Command(action))
            self._console.wait_for(over, _PATIENCE_S)
            if done(self._console.picture):
                took_s = self._console.picture.command_round_trips_s[-1]
                self._say(f"{action}: the robot is in {mode.name}, answered after {took_s:.3f} s")
                return
            if self._console.picture.mode is mode:
                self._say(f"{action}: the robot was in {mode.name} already: {self._last_words()}")
                return
            _log.warning("attempt %d: %s", attempt, self._last_words())
            self._await("control of the robot", lambda p: p.in_control)
        raise JobFailed(f"{action}: the robot did not reach {mode.name}: {self._last_words()}")

    @staticmethod
    def _refusals(action: Action, picture: Picture) -> int:
        return sum(not notice.good and notice.what == action for notice in picture.notices)

    def _drive(self) -> None:
        """Couple and drive; again when the robot has decoupled by itself before it moved."""
        for _ in range(_ATTEMPTS):
            self._command(Action.COUPLE, ControlMode.DIRECT)
            if self._draw_circle():
                self._say("drove the robot through the link")
                return
        raise JobFailed(f"the robot did not follow the hand: {self._last_words()}")

    def _draw_circle(self) -> bool:
        """Move the hand in a small circle, one event every 33 ms; whether the robot followed."""
        began_s = self._time.now_s()
        first = self._console.picture.robot
        assert first is not None
        home = np.array(first.position_m)
        while (t := self._time.now_s() - began_s) < _DRIVE_S:
            hand = 0.05 * np.array([np.cos(4.0 * t), np.sin(4.0 * t)] + [0.0] * (self._task.n_dims - 2))
            self._console.submit(intents.Hand(tuple(hand.tolist()), t))
            self._time.pause(_HAND_PERIOD_S)

        def moved(picture: Picture) -> bool:
            return picture.robot is not None and float(np.linalg.norm(picture.robot.position_m - home)) > 0.01

        self._await("the robot to follow the hand", lambda p: moved(p) or not p.coupled)
        return moved(self._console.picture)

    def _preview(self) -> None:
        before = self._console.picture.plan_id
        self._console.submit(intents.Command(Action.PREVIEW))
        self._await("the preview", lambda p: p.plan_id > before and Action.PREVIEW not in p.pending)
        path = self._console.picture.path
        assert path is not None
        self._say(f"previewed {duration_s(path):.1f} s of motion")

    def _cut(self, outage: PlannedOutage) -> None:
        """Cut the link when so much of the previewed motion is done, and wait until it is back."""
        path = self._console.picture.path
        assert path is not None
        cut_s = outage.at * duration_s(path)
        if self._control is None:
            raise JobFailed("an outage was asked for, but no link process is configured (link_control)")
        self._await("the moment to cut", lambda p: p.robot is not None and p.robot.elapsed_s >= cut_s)
        self._control.outage(outage.kind, outage.duration_s)
        robot = self._console.picture.robot
        assert robot is not None
        self._say(
            f"cut the link: {outage.kind} for {outage.duration_s:g} s, {robot.elapsed_s:.2f} s into the motion"
        )
        self._time.pause(outage.duration_s)
        self._await("the link to come back", lambda p: p.link.silent_s < 0.5)
        self._say("the link is back")

    def _measure(self) -> ExecutionReport:
        self._await("the arrival", lambda p: p.phase is Phase.ARRIVED)
        self._say("the robot reports its arrival")
        deadline_s = self._time.now_s() + _PATIENCE_S
        while self._time.now_s() < deadline_s:
            report = self._console.ask_report()
            if report is not None and report.tracked_s >= _TRACKING_S - 1e-6:
                return report
            self._time.pause(0.5)
        raise JobFailed("the robot did not report 10 s of tracking")

    # Words --------------------------------------------------------------------------------------

    def _result(self, report: ExecutionReport) -> dict[str, Any]:
        picture = self._console.picture
        learned = picture.learned
        assert learned is not None
        rms_m = report.rms_error_m
        amplitude_m = float(np.linalg.norm(self._task.target.amplitude_m))
        return {
            "task": self._task.name,
            "success": rms_m is not None and rms_m < self._task.success_rms_m,
            "n_demonstrations": picture.n_demonstrations,
            "n_components": int((~learned.model.terminal).sum()),
            "n_paths": learned.model.n_paths,
            "model_bytes": len(learned.content),
            "model_sha256": learned.sha256,
            "model_acknowledged": picture.confirmed_sha256 == learned.sha256,
            "link": self._link_result(picture),
            "execution": {
                "duration_s": report.arrived_after_s,
                "end_error_m": report.end_error_m,
                "rms_error_m": rms_m,
                "rms_over_s": report.tracked_s,
                "board_side_m": max(self._task.workspace_m),
                "target_amplitude_m": amplitude_m,
                "target_period_s": self._task.target.period_s,
                "control_overruns": report.overruns,
            },
            "events": self._events,
        }

    def _link_result(self, picture: Picture) -> dict[str, Any]:
        trips = picture.command_round_trips_s
        status = self._control.status() if self._control is not None else {}
        uplink = status.get("settings", {}).get("uplink", {})
        return {
            "profile": status.get("profile"),
            "delay_s": uplink.get("delay_ms", 0.0) * 1e-3,
            "outage": f"{self._outage.kind}:{self._outage.duration_s:g}" if self._outage else None,
            "command_round_trip_s": float(np.median(trips)),
            "command_round_trips_s": [round(trip, 4) for trip in trips],
            "relay_lateness_ms": {
                name: _lateness_ms(status.get(name, {})) for name in ("uplink", "downlink")
            },
        }

    def _await(self, what: str, holds: Callable[[Picture], bool]) -> None:
        if not self._console.wait_for(holds, _PATIENCE_S):
            raise JobFailed(f"waited {_PATIENCE_S:.0f} s for {what}: {self._last_words()}")

    def _say(self, text: str) -> None:
        time_s = self._time.now_s() - self._began_s
        self._events.append({"time_s": round(time_s, 3), "text": text})
        _log.info("%6.2f s  %s", time_s, text)

    def _last_words(self) -> str:
        """What the operator was told last, for the one who reads why it did not go on."""
        told = [f"{notice.what}: {notice.text}" for notice in self._console.picture.notices[-3:]]
        return "; ".join(told) or "nothing was reported"


def _lateness_ms(traffic: Mapping[str, Any]) -> dict[str, float | None]:
    """What the link process itself added to the delay [ms]; nothing is known of a real link."""
    return {name: traffic.get(f"lateness_{name}_ms") for name in ("p50", "p99", "max")}
