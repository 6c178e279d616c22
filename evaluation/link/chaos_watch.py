"""Observation of the robot in every control period, for the invariants."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable

from farhand.common.impairment.virtual_direction import Packet, PacketKind
from farhand.common.mode_table import ControlMode
from farhand.common.task import Task
from farhand.common.wire import keys
from farhand.common.wire.codec import decode
from farhand.common.wire.messages import Command, Message, OperatorInput, Stop
from farhand.evaluation.modes.invariants import Violation, all_invariants, violations
from farhand.evaluation.modes.period import Arrived, Period, Ran, RobotSnapshot
from farhand.remote_site.motion.model_trial import StoredModel
from farhand.remote_site.robot import Robot

_WATCHED: dict[str, type[Message]] = {
    keys.COMMAND.key: Command, keys.INPUT.key: OperatorInput, keys.STOP.key: Stop,
}  # fmt: skip
_MOST_REPORTED = 10


class ChaosWatch:
    """Observer of one robot through all its restarts.

    Args:
        task: Task of the robot.
        dt_s: Control period [s].
        max_age_s: Limit of ages [s].
        now_s: Returns the time.
    """

    def __init__(self, task: Task, dt_s: float, max_age_s: float, now_s: Callable[[], float]):
        self._dt_s, self._now_s = dt_s, now_s
        self._invariants = all_invariants(task, max_age_s)
        self._robot: Robot | None = None
        self._arrived: list[Arrived] = []
        self._ran: list[Ran] = []
        self.violations: list[Violation] = []
        self.periods: Counter[str] = Counter()
        """Number of control periods by the mode at their end."""
        self.transitions: Counter[str] = Counter()
        self.n_ran = self.n_arrived = 0

    def on_packet(self, packet: Packet) -> None:
        """Record a packet that reaches the robot."""
        kind = _WATCHED.get(packet.channel.key)
        if kind is not None and packet.kind is not PacketKind.ANSWER:
            self._arrived.append(Arrived(decode(packet.data, kind), packet.sent_s, self._now_s()))

    def before(self, robot: Robot) -> None:
        """Record the state before a control period."""
        if robot is not self._robot:
            self._robot = robot
            self._arrived, self._ran = [], []  # messages that came while the robot was down
            self._note_what_runs(robot)
        self._before = _snapshot(robot)

    def between(self, robot: Robot) -> None:
        """Record the state after the arrived messages were handled."""
        self._between = _snapshot(robot)

    def after(self, robot: Robot) -> None:
        """Check the finished control period."""
        after = _snapshot(robot)
        period = Period(
            self._now_s(), self._dt_s, self._before, self._between, after, tuple(self._arrived),
            tuple(self._ran), robot.supervisor.contact.usual_age_s,
        )  # fmt: skip
        found = violations(self._invariants, period)
        room = _MOST_REPORTED - len(self.violations)
        self.violations += found[: max(0, room)]
        self.periods[after.mode] += 1
        if after.mode is not self._before.mode:
            self.transitions[f"{self._before.mode} -> {after.mode}"] += 1
        self.n_arrived += len(self._arrived)
        self.n_ran += len(self._ran)
        self._arrived, self._ran = [], []

    def _note_what_runs(self, robot: Robot) -> None:
        """Listen to the mode machine's `run`, through which every executed command passes."""
        machine, lease = robot.supervisor.machine, robot.supervisor.contact.lease
        run = machine.run

        def listened(command: Command, stored: StoredModel | None) -> None:
            flights_s = [
                each.flight_s
                for each in self._arrived
                if isinstance(each.message, Command) and each.message.command_id == command.command_id
            ]
            self._ran.append(Ran(command, min(flights_s, default=0.0), lease.lease_id))
            run(command, stored)

        machine.run = listened


def _snapshot(robot: Robot) -> RobotSnapshot:
    supervisor = robot.supervisor
    coupling = supervisor.motion.coupling
    effector = robot.embodiment.hardware.plant.read()
    return RobotSnapshot(
        boot=supervisor.stamp().boot,
        mode=ControlMode(supervisor.mode),
        phase=supervisor.phase,
        lease_id=supervisor.contact.lease.lease_id,
        coupling=(coupling.coupling_id, coupling.lease_id) if coupling else None,
        position_m=effector.position_m,
        velocity_m_s=effector.velocity_m_s,
    )
