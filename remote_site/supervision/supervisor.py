"""Supervisor: judges every message, guards every tick, and drives the mode machine.

No I/O of its own: time comes from the clock, messages leave through `announce`. One thread calls all its
methods.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from farhand.common.clock import BootClock
from farhand.common.errors import InvalidInput
from farhand.common.mode_table import ControlMode, Guard, Phase
from farhand.common.task import TaskSet
from farhand.common.wire import keys
from farhand.common.wire.messages import (
    Command,
    CommandReply,
    EventKind,
    LeaseReply,
    LeaseRequest,
    OperatorInput,
    PlannedPath,
    Stamp,
    Stop,
)
from farhand.common.wire.motion_encoding import duration_s
from farhand.common.wire.reasons import Code, Reason, because
from farhand.remote_site.config import RemoteConfig
from farhand.remote_site.interface.embodiment import Belief, Embodiment, Guidance
from farhand.remote_site.interface.sensing import Sensing
from farhand.remote_site.motion.execution import Execution
from farhand.remote_site.motion.model_store import ModelStore
from farhand.remote_site.motion.motion import Motion, Outcome
from farhand.remote_site.motion.plans import Plans
from farhand.remote_site.motion.preview_worker import PlanRequest
from farhand.remote_site.supervision.admission import Admission, CommandLog, ModelReception
from farhand.remote_site.supervision.event_log import Announce, Events, Write
from farhand.remote_site.supervision.failsafe import BlackBox, Failsafe
from farhand.remote_site.supervision.guards import Guards, Trip
from farhand.remote_site.supervision.mode_machine import ModeMachine
from farhand.remote_site.supervision.operator_session import OperatorSession
from farhand.remote_site.supervision.recordings import Recordings


class Supervisor:
    """Supervisor of one robot.

    Args:
        tasks: Tasks of the robot.
        config: Rates and limits.
        embodiment: The robot.
        clock: The robot's clock.
        announce: Sends a message to the operators; never blocks.
        request_plan: Hands a rollout to the worker; never blocks.
        write: Writes an event to disk; never blocks.
    """

    def __init__(
        self,
        tasks: TaskSet,
        config: RemoteConfig,
        embodiment: Embodiment,
        clock: BootClock,
        announce: Announce,
        request_plan: Callable[[PlanRequest], None],
        write: Write,
    ):
        self._tasks, self._clock, self._announce = tasks, clock, announce
        self.embodiment, hardware = embodiment, embodiment.hardware
        control_hz, n_frames = hardware.control_hz, len(tasks.first.frame_names)
        self.sensing = Sensing(hardware.plant, hardware.perception, n_frames, control_hz, clock.now_s())
        self.contact = OperatorSession(config, clock, n_frames)
        self.models = ModelStore(tasks)
        self.motion = Motion(embodiment, self.sensing)
        self.events = Events(announce, self.stamp, write)
        self._plans = Plans(self.sensing, embodiment, request_plan)
        self.recordings = Recordings(
            tasks, self.sensing, self.motion, self.contact.lease, self.events, self.stamp
        )
        self.machine = ModeMachine(
            embodiment, self.sensing, self.motion, self._plans, self.events, announce, self.stamp, self.recordings
        )  # fmt: skip
        self._judge = Admission(tasks, self.contact, self.models, self._plans, self.sensing, embodiment.skill)
        self._log = CommandLog()
        self.reception = ModelReception(
            self.models, self.contact.lease, self.events, lambda: self.mode, self.stamp
        )
        self._watch = Guards(self.sensing, self.contact, self.motion, config.deadline_s)
        self._black_box = BlackBox(self.sensing, self.motion, control_hz, write)
        self.failsafe = Failsafe(self.motion, self.machine, self._black_box, control_hz)
        """Runs whatever is done in a control period."""
        self._holder = ""

    @property
    def mode(self) -> ControlMode:
        """Mode of the robot."""
        return self.machine.mode

    @property
    def phase(self) -> Phase:
        """Phase of AUTONOMOUS."""
        return self.machine.phase

    @property
    def path_id(self) -> int:
        """Committed path in execution, 0 for none."""
        return self.machine.path_id

    @property
    def last_execution(self) -> Execution | None:
        """Newest execution of this boot, even after its end."""
        return self.machine.last_execution

    def stamp(self) -> Stamp:
        """Return the present stamp."""
        return Stamp(self._clock.boot, self._clock.now_ns())

    # What arrives -------------------------------------------------------------------------------

    def on_lease(self, request: LeaseRequest, certified: str = "") -> LeaseReply:
        """Grant, renew, refuse or hand over the control of the robot.

        Args:
            request: The request.
            certified: Name in the certificate of the asking site; empty where none tells it.
        """
        reply = self.contact.answer(request, self._tasks, self.stamp(), certified)
        self._tell_holder()
        return reply

    def on_stop(self, stop: Stop) -> None:
        """Stop in every mode, whoever asks."""
        self.machine.stop(stop)

    def on_input(self, message: OperatorInput) -> None:
        """Follow the operator's hand, if the input is fresh and of the present coupling."""
        coupling = self.motion.coupling
        theirs = (message.lease_id, message.coupling_id)
        if coupling is None or theirs != (coupling.lease_id, coupling.coupling_id):
            self.contact.stale_refused += 1
        elif self.contact.is_fresh(message.echo):
            coupling.feed(message, self.sensing.effector.controlled[0], self._clock.now_s())

    def on_command(self, command: Command) -> CommandReply:
        """Run a command once, or answer it again."""
        if (known := self._log.reply_to(command.command_id)) is not None:
            return known
        reason = self._judge.refusal(command, self.mode, self.phase, self.stamp())
        if reason is not None:
            self.events.refused(command.action, self.contact.lease.holder, reason, self.mode)
        else:
            self.machine.run(command, self.models.get(command.model_sha256))
        reply = CommandReply(
            command_id=command.command_id, accepted=reason is None, reason=reason, mode=self.mode,
            stamp=self.stamp(),
        )  # fmt: skip
        self._log.remember(reply)
        return reply

    def on_path(self, request: PlanRequest, path: PlannedPath | None, note: Reason | None) -> None:
        """Take a rollout, or the reason why there is none.

        Args:
            request: The request.
            path: The rollout, None when there is none.
            note: Reason why there is no rollout, or a warning to the operator.
        """
        command = self.machine.previews.finish(request, path)
        if request.plan_id and command is None:
            return  # a newer preview has replaced it
        if path is not None:
            self._announce(keys.PATH, path)
        if command is None:
            if path is not None and self.motion.execution is not None:
                self.machine.path_id = path.path_id
        elif path is None:
            self.machine.fail(command, note or because(Code.PLAN_FAILED, text=""))
        else:
            code = Code.PREVIEWED if note is None else Code.PREVIEWED_WITH_WARNING
            result = because(code, motion_s=duration_s(path), model=request.stored.label)
            self.machine.complete(command, result, cause=note, plan_id=request.plan_id)

    # The tick -----------------------------------------------------------------------------------

    def tick(self, dt_s: float, late_s: float = 0.0) -> None:
        """Do one control period: sense, believe, guard, move.

        Args:
            dt_s: The period [s].
            late_s: Delay of the period's beginning [s].
        """
        self.failsafe.run(partial(self._tick, dt_s, late_s))

    def _tick(self, dt_s: float, late_s: float) -> None:
        now_s = self._clock.now_s()
        belief, trip = self._believe(now_s, dt_s)
        self.contact.lease.expire(now_s)
        self._tell_holder()
        trip = trip or self._watch.trip(self.mode, belief.guidance, now_s, dt_s, late_s)
        self._black_box.remember(now_s, self.mode)
        self.embodiment.skill.apply(belief.guidance)
        fault = trip is not None and trip.guard is Guard.FAULT
        if fault:
            self.motion.halt(dt_s)  # before anything is logged or announced
        if trip is not None:
            self._trip(trip)
        self.recordings.sample()
        if not fault:
            self._move(belief.guidance, now_s, dt_s)

    def _believe(self, now_s: float, dt_s: float) -> tuple[Belief, Trip | None]:
        """Sense, and return the belief; a measurement without meaning is a fault, as is one that a driver tells."""
        sensing = self.sensing
        try:
            sensing.update(now_s)
            if told := sensing.fault:
                return Belief(sensing.seen), Trip(Guard.FAULT, because(Code.MACHINE_FAULT, text=told))
            if not sensing.is_plausible:
                return Belief(sensing.seen), Trip(Guard.FAULT, because(Code.NOT_FINITE_MEASURED))
            belief = self.embodiment.skill.believe(sensing, self.motion.executing, now_s, dt_s)
        except InvalidInput as error:
            return Belief(sensing.seen), Trip(Guard.FAULT, because(Code.MEASUREMENT_WRONG, text=str(error)))
        sensing.frames = belief.frames
        return belief, None

    def _move(self, guidance: Guidance, now_s: float, dt_s: float) -> None:
        execution, manoeuvre = self.motion.execution, self.motion.manoeuvre
        match self.motion.step(guidance, now_s, dt_s, wait=self._watch.must_wait):
            case Outcome.UNDER_WAY if execution is not None:
                self._plans.commit(execution, self.stamp())
            case Outcome.ARRIVED if execution is not None:
                self.machine.arrived(execution)
            case Outcome.ENDED if manoeuvre is not None:
                self.machine.end_manoeuvre(manoeuvre)
            case Outcome.FAILED if self.motion.failure is not None:
                self._trip(Trip(Guard.FAULT, self.motion.failure))
            case Outcome.STANDING:
                self.machine.on_standstill()

    def _trip(self, trip: Trip) -> None:
        fault = trip.guard is Guard.FAULT
        if fault and self.mode is ControlMode.STOPPED:
            return  # said once
        if self.machine.trip(trip) and fault:
            self._black_box.dump()

    def _tell_holder(self) -> None:
        """Announce that the control of the robot changed hands."""
        holder, before = self.contact.lease.holder, self._holder
        if holder != before:
            self._holder = holder
            why = because(Code.CONTROL_TAKEN if holder else Code.CONTROL_LOST, site=holder or before)
            freed = None if holder else self.contact.lease.freed_because
            self.machine.tell(EventKind.CONTROL, why, who=holder or before, cause=freed)
