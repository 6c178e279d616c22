"""The robot's authority: owns the mode, judges every command, decides what moves the plant each tick.

Pure but for what it is given: time comes from the clock, what it has to say goes to `announce`. All of
its methods are called by one thread.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from common import keys
from common.clock import BootClock
from common.control_mode import Action, ControlMode, Phase, mode_after
from common.keys import Channel
from common.messages import (
    Command,
    CommandReply,
    Event,
    LeaseReply,
    LeaseRequest,
    Message,
    ModelReply,
    ModelTransfer,
    OperatorInput,
    PlannedPath,
    Stamp,
    Stop,
)
from common.task import Task
from remote_site.command_judge import CommandJudge
from remote_site.command_log import CommandLog
from remote_site.config import RemoteConfig
from remote_site.contact import OperatorContact
from remote_site.coupling import Coupling
from remote_site.execution import Execution
from remote_site.model_store import ModelStore, StoredModel
from remote_site.motion import Motion, Outcome
from remote_site.perception import Perception
from remote_site.planner import PlanRequest
from remote_site.plans import Plans
from remote_site.plant import Plant
from remote_site.reproduction.executor import ExecutorSettings
from remote_site.sensing import Sensing
from remote_site.stops import Stops

Announce = Callable[[Channel, Message], None]


class Supervisor:
    """Mode machine of one robot.

    Args:
        task: What the robot does.
        config: Rates and limits.
        plant: The machine.
        perception: Its sensing.
        clock: Its time.
        announce: Sends a message to the operators; never blocks.
        request_plan: Hands a rollout to the worker; never blocks.
    """

    def __init__(
        self,
        task: Task,
        config: RemoteConfig,
        plant: Plant,
        perception: Perception,
        clock: BootClock,
        announce: Announce,
        request_plan: Callable[[PlanRequest], None],
    ):
        self._task, self._clock = task, clock
        self._announce = announce
        self._settings = ExecutorSettings(
            dt_s=1.0 / config.control_hz,
            max_speed_m_s=task.limits.speed_m_s,
            max_acceleration_m_s2=task.limits.acceleration_m_s2,
        )
        self.sensing = Sensing(plant, perception, config.control_hz, clock.now_s())
        self.contact = OperatorContact(config, clock)
        self.models = ModelStore(task)
        self._plans = Plans(self.sensing, self._settings, request_plan)
        self._stops = Stops(lambda acknowledgement: announce(keys.STOP_ACK, acknowledgement))
        self._judge = CommandJudge(task, self.contact, self.models, self._plans)
        self._log = CommandLog()
        self.mode = ControlMode.DISARMED
        self.motion = Motion(plant, perception, self.sensing, task.limits)
        self.last_execution: Execution | None = None
        self.path_id = 0
        self._coupling_count = 0
        self._event_seq = 0
        self._until_standing: list[Command] = []
        self._previewing: dict[int, Command] = {}

    @property
    def phase(self) -> Phase:
        """Where the execution is."""
        return self.motion.execution.phase if self.motion.execution else Phase.NONE

    def stamp(self) -> Stamp:
        """Now."""
        return Stamp(self._clock.boot, self._clock.now_ns())

    # What arrives -------------------------------------------------------------------------------

    def on_lease(self, request: LeaseRequest) -> LeaseReply:
        """Grant, renew or refuse the control of the robot."""
        return self.contact.answer(request, self._task, self.stamp())

    def on_model(self, transfer: ModelTransfer) -> ModelReply:
        """Verify and keep a model; it becomes active with the next Execute that names it."""
        return self.models.answer(transfer, self.stamp())

    def on_stop(self, stop: Stop) -> None:
        """Stop, whoever asks and in whatever mode."""
        if self._stops.receive(stop.stop_id, self.stamp()):
            self._leave_motion(f"stopped by {stop.site_name}")
            self.mode = ControlMode.STOPPED
            self._event("stopped", f"stop by {stop.site_name}")

    def on_input(self, message: OperatorInput) -> None:
        """Follow the operator's hand, if coupled, by the holder, with this coupling, and fresh."""
        coupling = self.motion.coupling
        theirs = (message.lease_id, message.coupling_id)
        if coupling is None or theirs != (coupling.lease_id, coupling.coupling_id):
            self.contact.stale_refused += 1
        elif self.contact.input_is_fresh(message):
            coupling.feed(message, self.sensing.effector.position_m, self._clock.now_s())

    def on_command(self, command: Command) -> CommandReply:
        """Run a command once, or answer it again."""
        if (known := self._log.reply_to(command.command_id)) is not None:
            return known
        reason, measured = self._judge.refusal(command, self.mode, self.phase, self.stamp())
        if not reason:
            self._run(command)
        reply = CommandReply(
            command_id=command.command_id,
            accepted=not reason,
            reason=reason,
            measured=measured,
            mode=self.mode,
            stamp=self.stamp(),
        )
        self._log.remember(reply)
        return reply

    def on_path(self, request: PlanRequest, path: PlannedPath | None, problem: str) -> None:
        """A rollout is ready, or could not be made."""
        command = self._previewing.pop(request.plan_id, None)
        if request.plan_id and command is None:
            return  # a newer preview has replaced it
        if path is not None:
            self._announce(keys.PATH, path)
        if command is None:
            if path is not None and self.motion.execution is not None:
                self.path_id = path.path_id
            return
        if path is None:
            self._fail([command], problem)
            return
        self._plans.shown(request)
        duration_s = (len(path.points) // (4 * path.n_dims) - 1) * path.step_s
        self._complete(command, f"previewed {duration_s:.1f} s of motion", plan_id=request.plan_id)

    # Commands -----------------------------------------------------------------------------------

    def _run(self, command: Command) -> None:
        """Do an allowed command; its second answer comes as an event."""
        target = mode_after(self.mode, self.phase, command.action)
        assert target is not None
        stored = self.models.get(command.model_sha256)
        if command.action is Action.PREVIEW and stored is not None:
            self._fail(self._previewing.values(), "replaced by a newer preview")
            self._previewing = {self._plans.preview(stored, self.stamp()): command}
            return
        self._leave_motion(f"ended by {command.action}")
        self._fail(self._until_standing, f"{command.action} came before the robot stood still")
        self._until_standing.clear()
        self.mode = target
        if command.action is Action.EXECUTE and stored is not None:
            self._execute(command, stored)
        elif command.action is Action.COUPLE:
            self._coupling_count += 1
            self.motion.coupling = Coupling(self._coupling_count, command.lease_id, self._clock.now_s())
            self._complete(command, "coupled", coupling_id=self._coupling_count)
        else:
            self._until_standing.append(command)

    def _execute(self, command: Command, stored: StoredModel) -> None:
        sensed = self.sensing
        self.motion.execution = self.last_execution = Execution(
            command, stored, self._settings, sensed.effector, sensed.frames, self.stamp()
        )  # fmt: skip
        self._event("executing", f"executing {stored.sha256[:8]}", command_id=command.command_id)
        self._plans.forget_commit()

    def _leave_motion(self, why: str) -> None:
        """End whatever moves the robot; the plant brakes from the next tick on."""
        if self.motion.execution is not None and self.motion.execution.arrived_after_s is None:
            self._fail([self.motion.execution.command], why)
        self.motion.end()
        self.path_id = 0

    # The tick -----------------------------------------------------------------------------------

    def tick(self, dt_s: float) -> None:
        """One control period: sense, watch the operator, move."""
        now_s = self._clock.now_s()
        self.sensing.update(now_s)
        self.contact.lease.expire(now_s)
        coupling, execution = self.motion.coupling, self.motion.execution
        if coupling is not None and (
            why := self.contact.lost_reason(coupling.lease_id, now_s) or coupling.end_reason(now_s)
        ):
            self._leave_motion(why)
            self.mode = ControlMode.HOLD
            self._event("decoupled", why)
        match self.motion.step(now_s, dt_s):
            case Outcome.UNDER_WAY if execution is not None:
                self._plans.commit(execution, self.stamp())
            case Outcome.ARRIVED if execution is not None:
                self._complete(execution.command, f"arrived after {execution.arrived_after_s:.2f} s")
            case Outcome.FAILED if self.mode is not ControlMode.STOPPED:
                why = "a measured or computed number is not finite"
                self._leave_motion(why)
                self.mode = ControlMode.STOPPED
                self._event("stopped", why, succeeded=False)
            case Outcome.STANDING:
                self._settle()

    def _settle(self) -> None:
        """Answer what waits for the robot to stand still."""
        for command in self._until_standing:
            self._complete(command, "done")
        self._until_standing.clear()
        self._stops.stands(self.stamp())

    def _complete(self, command: Command, text: str, **ids: int) -> None:
        self._event("completed", text, command_id=command.command_id, **ids)

    def _fail(self, commands: Iterable[Command], why: str) -> None:
        for command in commands:
            self._event("failed", why, command_id=command.command_id, succeeded=False)

    def _event(self, kind: str, text: str, **fields: Any) -> None:
        self._event_seq += 1
        self._announce(
            keys.EVENT,
            Event(
                seq=self._event_seq, stamp=self.stamp(), kind=kind, text=text[:500], mode=self.mode, **fields
            ),
        )
