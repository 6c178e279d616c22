"""Whatever fails in a control period: the robot brakes, is STOPPED, says so, and goes on answering."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
import pytest

from farhand.common.control_mode import Action, ControlMode
from farhand.common.wire.messages import StopAck
from farhand.remote_site.motion.execution import Execution
from farhand.remote_site.reproduction.executor import Executor
from tests.messages import said
from tests.remote_site.bench import BEGINNINGS, DT_S, Bench, FeelingPlant, in_mode


class HaltingPlant(FeelingPlant):
    """One whose machine can stop without the loop. Its driver fails in what it is told to."""

    def __init__(self) -> None:
        super().__init__()
        self.fails: set[str] = set()

    def _maybe_fail(self, what: str) -> None:
        if what in self.fails:
            raise OSError(5, f"the driver lost its bus in {what}")

    def read(self):
        self._maybe_fail("read")
        return super().read()

    def accelerate(self, acceleration: np.ndarray, dt_s: float) -> None:
        self._maybe_fail("accelerate")
        super().accelerate(acceleration, dt_s)

    def follow(self, point: np.ndarray, max_speed_m_s: float, dt_s: float) -> None:
        self._maybe_fail("follow")
        super().follow(point, max_speed_m_s, dt_s)

    def brake(self, dt_s: float) -> None:
        self._maybe_fail("brake")
        super().brake(dt_s)

    def halt(self) -> None:
        self.told.append("halt")
        self._velocity = np.zeros_like(self._velocity)


def failing(error: Exception) -> Callable[..., None]:
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
              OSError(19, "no such device"), RecursionError("too deep"), MemoryError(), AssertionError("a bug")],
    ids=lambda error: type(error).__name__,
)  # fmt: skip
def test_any_error_of_an_execution_stops_the_robot_in_its_own_words(monkeypatch, error: Exception):
    bench = Bench().executing()
    assert bench.speed_m_s > 0.1
    with monkeypatch.context() as patched:
        patched.setattr(Executor, "step", failing(error))
        bench.run(DT_S)
    assert_stopped(bench, f"{type(error).__name__}: {error}")


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
def test_a_driver_whose_brake_fails_too_is_halted_in_every_period(fails: set[str]):
    plant = HaltingPlant()
    bench = Bench(plant=plant).executing()
    plant.fails = fails
    bench.stop()
    for _ in range(20):
        bench.time.advance(DT_S)
        bench.robot.tick(DT_S)
    assert bench.mode is ControlMode.STOPPED and plant.told.count("halt") == 20
    assert not any(ack.standing for ack in bench.heard(StopAck))  # nobody knows
    plant.fails = set()
    bench.run(0.5)
    assert any(ack.standing for ack in bench.heard(StopAck))


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
