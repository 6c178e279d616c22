"""What holds whatever the operator, the link and the sensors do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from farhand.common.mode_table import Action, ControlMode
from farhand.common.wire.messages import Event
from farhand.remote_site.interface.plant import EffectorState, PointPlant
from tests.remote_site.bench import BEGINNINGS, DT_S, Bench
from tests.remote_site.planar import TASK

NOT_STOPPED = [mode for mode in ControlMode if mode is not ControlMode.STOPPED]


class BrokenSensor(PointPlant):
    """A machine whose position is not a number once it is `broken`."""

    broken = False

    def read(self) -> EffectorState:
        state = super().read()
        return replace(state, point=np.full(2, np.nan)) if self.broken else state


@pytest.mark.parametrize("mode", NOT_STOPPED)
def test_a_measurement_that_is_not_finite_stops_the_robot_once(mode: ControlMode):
    limits = TASK.limits
    plant = BrokenSensor(np.array(TASK.start_m), np.ones(2), limits.speed_m_s, limits.acceleration_m_s2)
    bench = Bench(plant=plant)
    BEGINNINGS[mode](bench)
    plant.broken = True
    bench.run(0.5)
    plant.broken = False
    assert bench.mode is ControlMode.STOPPED and bench.speed_m_s < 1e-6
    assert [e.succeeded for e in bench.heard(Event) if e.kind == "stopped"] == [False]
    assert np.isfinite(bench.position_m).all()
    bench.run(0.1)
    bench.ask_lease()
    assert bench.command(Action.RESET).accepted


STEPS = st.lists(
    st.one_of(
        st.tuples(st.just("command"), st.sampled_from(sorted(Action))),
        st.tuples(st.just("drive"), st.sampled_from([0.0, 0.1, 0.6, -0.4])),
        st.tuples(st.just("wait"), st.sampled_from([0.1, 0.7, 3.5])),
        st.tuples(st.just("outage"), st.sampled_from([0.3, 1.0, 4.0])),
        st.tuples(st.just("stop"), st.just(0)),
    ),
    min_size=3,
    max_size=14,
)


@settings(deadline=None, derandomize=True, max_examples=12)
@given(steps=STEPS)
def test_whatever_happens_the_limits_hold_and_only_driving_and_executing_move(steps: list):
    bench = Watched()
    bench.ask_lease()
    sha256 = bench.send_model().sha256
    for n, (kind, value) in enumerate(steps):
        if kind == "command":
            bench.ask_lease()
            bench.command(value, model_sha256=sha256)
        elif kind == "drive":
            bench.drive(0.4, value)
        elif kind == "stop":
            bench.stop(f"stop {n}")
        else:
            bench.run(value, present=kind == "wait")


class Watched(Bench):
    """Checks every control period."""

    def run(self, duration_s: float, present: bool = True) -> None:
        for _ in range(round(duration_s / DT_S)):
            before, mode = self.plant.read(), self.mode
            super().run(DT_S, present)
            after = self.plant.read()
            change = np.linalg.norm(after.velocity_m_s - before.velocity_m_s)
            speeds = np.linalg.norm(before.velocity_m_s), np.linalg.norm(after.velocity_m_s)
            at_an_edge = ((after.position_m <= 0.0) | (after.position_m >= 1.0)).any()
            assert at_an_edge or change <= TASK.limits.acceleration_m_s2 * DT_S + 1e-9
            assert speeds[1] <= TASK.limits.speed_m_s + 1e-9
            if mode is self.mode and mode not in (ControlMode.DIRECT, ControlMode.AUTONOMOUS):
                assert speeds[1] == 0.0 or speeds[1] < speeds[0]
            if self.mode is ControlMode.DIRECT:
                assert self.robot.contact.lease.lease_id == self.lease_id
