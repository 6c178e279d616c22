"""Whatever fails in a control period: the robot brakes, is STOPPED, says so, and goes on answering."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import cast

import numpy as np
import pytest

from farhand.common.mode_table import Action, ControlMode
from farhand.common.model.task_frame import TaskFrame
from farhand.common.wire.codec import decode, encode
from farhand.common.wire.messages import Event, StopAck, Telemetry
from farhand.remote_site.interface.plant import EffectorState
from farhand.remote_site.motion.execution import Execution
from farhand.remote_site.reproduction.executor import Executor
from farhand.remote_site.robots.point_embodiment import point_embodiment
from farhand.remote_site.supervision.guards import STILL_S
from farhand.remote_site.telemetry import Reporter
from tests.messages import said
from tests.remote_site.bench import BEGINNINGS, DT_S, Bench, FeelingPlant, Sight, in_mode
from tests.remote_site.planar import TASK


class HaltingPlant(FeelingPlant):
    """One whose machine can stop without the loop. Its driver fails in what it is told to."""

    def __init__(self) -> None:
        super().__init__()
        self.fails: set[str] = set()
        self.words = "emergency stop"
        self.ends = False
        """Whether the driver ends the process instead of raising."""

    def _maybe_fail(self, what: str) -> None:
        if what in self.fails and self.ends:
            sys.exit(f"the driver lost its bus in {what}")
        if what in self.fails:
            raise OSError(5, f"the driver lost its bus in {what}")

    def read(self) -> EffectorState:
        self._maybe_fail("read")
        state = super().read()
        if "finite" in self.fails:
            return replace(state, point=state.point * np.nan)
        if "huge" in self.fails:
            return replace(state, point=state.point + 1e7)
        if "shape" in self.fails:
            return replace(state, velocity=np.zeros(3))
        return cast(EffectorState, [state]) if "kind" in self.fails else state

    def accelerate(self, acceleration: np.ndarray, dt_s: float) -> None:
        self._maybe_fail("accelerate")
        if "stands" in self.fails:
            self._velocity = np.zeros_like(self._velocity)
            return
        super().accelerate(acceleration, dt_s)

    def follow(self, point: np.ndarray, max_speed_m_s: float, dt_s: float) -> None:
        self._maybe_fail("follow")
        super().follow(point, max_speed_m_s, dt_s)

    def brake(self, dt_s: float) -> None:
        self._maybe_fail("brake")
        super().brake(dt_s)

    @property
    def fault(self) -> str:
        return self.words if "told" in self.fails else ""

    def halt(self) -> None:
        self.told.append("halt")
        self._velocity = np.zeros_like(self._velocity)


def failing(error: BaseException) -> Callable[..., None]:
    def fail(*_args: object, **_named: object) -> None:
        raise error

    return fail


def assert_stopped(bench: Bench, words: str) -> None:
    """It stands, said why once, wrote the last seconds down, and does what it is asked."""
    bench.run(1.0)
    assert bench.mode is ControlMode.STOPPED and bench.speed_m_s < 1e-9
    (told,) = bench.events("stopped")
    assert words in said(told) and not told.succeeded
    assert any(row["kind"] == "black box" for row in bench.written)
    bench.stop("afterwards")
    bench.run(0.1)
    assert any(ack.stop_id == "afterwards" and ack.standing for ack in bench.heard(StopAck))
    assert bench.command(Action.RESET).accepted
    bench.run(0.1)
    assert bench.command(Action.ARM).accepted


@pytest.mark.parametrize(
    "error", [np.linalg.LinAlgError("Singular matrix"), ZeroDivisionError("division"), KeyError("joint"),
              OSError(19, "no such device"), RecursionError("too deep"), MemoryError(), AssertionError("a bug"),
              SystemExit("the maker's library ends"), asyncio.CancelledError("its bus"), GeneratorExit("closed")],
    ids=lambda error: type(error).__name__,
)  # fmt: skip
def test_any_error_of_an_execution_stops_the_robot_in_its_own_words(monkeypatch, error: BaseException):
    bench = Bench().executing()
    assert bench.speed_m_s > 0.1
    with monkeypatch.context() as patched:
        patched.setattr(Executor, "step", failing(error))
        bench.run(DT_S)
    assert_stopped(bench, f"{type(error).__name__}: {error}")


class Untold(Exception):
    """Error whose words fail too."""

    def __str__(self) -> str:
        raise RuntimeError("no words")


def test_an_error_without_words_stops_the_robot_under_its_name(monkeypatch):
    bench = Bench().executing()
    with monkeypatch.context() as patched:
        patched.setattr(Executor, "step", failing(Untold()))
        bench.run(DT_S)
    assert_stopped(bench, "Untold: (its text cannot be shown)")


@pytest.mark.parametrize(
    "text", ["line one\nline two", "undecoded \udcff", "turned \u202e", "nothing \0", "x" * 5000]
)
def test_whatever_a_driver_says_reaches_the_operator_in_one_line(text: str):
    plant = HaltingPlant()
    bench = Bench(plant=plant).executing()
    plant.fails, plant.words = {"told"}, text
    bench.run(DT_S)
    (told,) = bench.events("stopped")
    words = said(decode(encode(told), Event))
    assert (
        words.startswith("the robot's machine reports a fault: ") and words.isprintable() and len(words) < 400
    )
    plant.fails = set()
    assert_stopped(bench, "reports a fault")


PLACES = {
    "sight": lambda bench, fail: partial(setattr, bench.sight, "observe", fail),
    "what contact means": lambda bench, fail: partial(setattr, bench.robot.embodiment.skill, "believe", fail),
    "the guards": lambda bench, fail: partial(setattr, bench.robot._watch, "trip", fail),
    "the black box": lambda bench, fail: partial(setattr, bench.robot._black_box, "remember", fail),
    "the lease": lambda bench, fail: partial(setattr, bench.robot.contact.lease, "expire", fail),
    "recordings": lambda bench, fail: partial(setattr, bench.robot.recordings, "sample", fail),
}


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("mode", [mode for mode in ControlMode if mode is not ControlMode.STOPPED])
def test_an_error_anywhere_in_a_period_stops_the_robot_from_every_mode(mode: ControlMode, place: str):
    bench = in_mode(mode)
    PLACES[place](bench, failing(RuntimeError(f"{place} failed")))()
    for _ in range(50):
        bench.time.advance(DT_S)
        bench.robot.tick(DT_S)
    assert bench.mode is ControlMode.STOPPED and bench.speed_m_s < 1e-9
    (told,) = bench.events("stopped")
    assert f"RuntimeError: {place} failed" in said(told)


@pytest.mark.parametrize(
    ("mode", "call"), [(ControlMode.AUTONOMOUS, "accelerate"), (ControlMode.DIRECT, "follow")]
)
def test_a_driver_that_fails_is_braked_and_its_machine_halted(mode: ControlMode, call: str):
    plant = HaltingPlant()
    bench = Bench(plant=plant)
    BEGINNINGS[mode](bench)
    if mode is ControlMode.DIRECT:
        bench.drive(0.3, 0.5, 0.5)
    plant.told.clear()
    plant.fails = {call}
    if mode is ControlMode.DIRECT:
        bench.drive(DT_S, 0.6, 0.5)
    bench.run(DT_S)
    assert plant.told[:2] == ["brake", "halt"]
    assert_stopped(bench, "the driver lost its bus")


@pytest.mark.parametrize(
    "fails", [{"read"}, {"brake"}, {"read", "brake"}, {"read", "brake", "accelerate", "follow"}]
)
@pytest.mark.parametrize("ends", [False, True])
def test_a_driver_whose_brake_fails_too_is_halted_in_every_period(fails: set[str], ends: bool):
    plant = HaltingPlant()
    bench = Bench(plant=plant).executing()
    plant.fails, plant.ends = fails, ends
    bench.stop()
    for _ in range(20):
        bench.time.advance(DT_S)
        bench.robot.tick(DT_S)
    assert bench.mode is ControlMode.STOPPED and plant.told.count("halt") == 20
    assert not any(ack.standing for ack in bench.heard(StopAck))  # nobody knows
    plant.fails = set()
    bench.run(0.5)
    assert any(ack.standing for ack in bench.heard(StopAck))


FAULTS = {
    "told": "the robot's machine reports a fault: emergency stop",
    "read": "OSError: [Errno 5] the driver lost its bus in read",
    "finite": "a measured number is not finite",
    "huge": "or beyond a million",
    "shape": "plant: read: velocity: an array of shape (2,), got shape (3,)",
    "kind": "plant: read: an EffectorState, got list",
}


@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize("mode", [ControlMode.HOLD, ControlMode.DIRECT, ControlMode.AUTONOMOUS])
def test_a_machine_with_a_fault_is_halted_told_and_can_be_used_again_once_it_is_mended(
    mode: ControlMode, fault: str
):
    plant = HaltingPlant()
    bench = Bench(plant=plant)
    BEGINNINGS[mode](bench)
    plant.told.clear()
    plant.fails = {fault}
    bench.run(DT_S)
    assert plant.told == ["brake", "halt"], "before anything else"
    bench.run(1.0)
    assert bench.mode is ControlMode.STOPPED
    report = Reporter(bench.robot, bench.clock).report()
    assert decode(encode(report), Telemetry).mode is ControlMode.STOPPED  # which an operator can read
    (told,) = bench.events("stopped")
    assert FAULTS[fault] in said(told) and not told.succeeded
    assert bench.command(Action.RESET).accepted  # too early: it is stopped again, and told again
    bench.run(0.1)
    assert bench.mode is ControlMode.STOPPED and len(bench.events("stopped")) == 2
    plant.fails = set()
    assert bench.command(Action.RESET).accepted
    bench.run(0.1)
    assert bench.command(Action.ARM).accepted
    bench.run(0.1)
    assert bench.mode is ControlMode.HOLD


def test_a_machine_that_stands_still_is_noticed_halted_and_told():
    plant = HaltingPlant()
    bench = Bench(plant=plant).executing()
    plant.fails = {"stands"}
    bench.run(STILL_S - 0.1)
    assert bench.mode is ControlMode.AUTONOMOUS and "halt" not in plant.told
    bench.run(0.3)
    assert "halt" in plant.told
    plant.fails = set()
    assert_stopped(bench, "stands still for 2 s although it is told to move")


def test_a_driver_that_holds_up_the_loop_is_halted_and_told():
    plant = HaltingPlant()
    bench = Bench(plant=plant).executing()
    plant.told.clear()
    bench.time.advance(0.6)
    bench.robot.tick(DT_S, late_s=0.6)
    assert plant.told == ["brake", "halt"]
    assert_stopped(bench, "the control loop was 600 ms late")


@pytest.mark.parametrize("cause", ["paused", "unseen", "arrived"])
def test_a_robot_that_stands_because_it_shall_is_left_alone(cause: str):
    plant = HaltingPlant()
    bench = Bench(plant=plant).arrived() if cause == "arrived" else Bench(plant=plant).executing()
    if cause == "paused":
        assert bench.command(Action.PAUSE).accepted
    bench.sight.seen = cause != "unseen"
    bench.run(STILL_S + 1.0)
    assert "halt" not in plant.told and not bench.events("stopped")


@pytest.mark.parametrize(
    ("frames", "words"),
    [
        ([], "1 task frames, as the task's frame_names has, got 0"),
        ([TaskFrame.identity(3)], "frames of 2 dimensions, got 3"),
        ([TaskFrame(np.eye(2), np.full(2, 1e7))], "no origin beyond a million metres"),
        ((np.eye(2), np.zeros(2)), "a list of TaskFrame, or None; got (array"),
    ],
    ids=["number", "dimension", "far off", "kind"],
)
def test_a_sight_that_returns_something_else_stops_the_robot(monkeypatch, frames: object, words: str):
    bench = Bench(plant=HaltingPlant()).executing()
    with monkeypatch.context() as patched:
        patched.setattr(bench.sight, "observe", lambda now_s: frames)
        bench.run(DT_S)
    assert_stopped(bench, words)


def test_a_fault_of_the_sight_halts_the_machine():
    class Camera(Sight):
        fault = ""

    plant, camera = HaltingPlant(), Camera(TASK)
    bench = Bench(embodiment=point_embodiment(TASK, plant, camera)).executing()
    camera.fault = "the camera is unplugged"
    bench.run(DT_S)
    camera.fault = ""
    assert "halt" in plant.told
    assert_stopped(bench, "reports a fault: the camera is unplugged")


def test_a_failure_that_cannot_even_be_told_stops_the_robot(monkeypatch):
    bench = Bench().executing()
    monkeypatch.setattr(Execution, "step", failing(np.linalg.LinAlgError("Singular matrix")))
    monkeypatch.setattr(bench.robot.machine, "tell", failing(RuntimeError("no words")))
    bench.run(1.0)
    assert bench.mode is ControlMode.STOPPED and bench.speed_m_s < 1e-9


def test_a_message_whose_handling_fails_stops_the_robot_and_the_others_are_handled(monkeypatch):
    bench = Bench().executing()
    monkeypatch.setattr(bench.robot.models, "take", failing(ValueError("a bug")))
    bench.robot.failsafe.run(lambda: bench.send_model() and None)
    assert_stopped(bench, "ValueError: a bug")
