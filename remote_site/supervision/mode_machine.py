"""Mode of the robot, and everything that changes it: commands, stops, guards, ends of motions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

from farhand.common.mode_table import TABLE, Action, Cause, ControlMode, Guard, Phase, mode_after
from farhand.common.wire import keys
from farhand.common.wire.messages import Command, EventKind, Stamp, Stop
from farhand.common.wire.reasons import Code, Reason, because
from farhand.remote_site.interface.embodiment import Embodiment
from farhand.remote_site.interface.sensing import Sensing
from farhand.remote_site.motion.coupling import Coupling
from farhand.remote_site.motion.execution import Execution
from farhand.remote_site.motion.manoeuvre import Manoeuvre, Manoeuvres
from farhand.remote_site.motion.model_trial import StoredModel
from farhand.remote_site.motion.motion import Motion
from farhand.remote_site.motion.plans import Plans, Previews
from farhand.remote_site.supervision.event_log import Announce, Events
from farhand.remote_site.supervision.guards import Trip
from farhand.remote_site.supervision.recordings import Recordings
from farhand.remote_site.supervision.stop import Stops

# Kind of the event that tells of each guard's action.
_KINDS = {
    Guard.COUPLING_ENDED: EventKind.DECOUPLED,
    Guard.FORCE: EventKind.BACKING_OFF,
    Guard.JAMMED: EventKind.GAVE_UP,
    Guard.PERCEPTION_LOST: EventKind.PAUSED,
    Guard.LINK_LOST_HOLD: EventKind.PAUSED,
    Guard.LINK_LOST_RETRACT: EventKind.RETRACTING,
    Guard.FAULT: EventKind.STOPPED,
}


class ModeMachine:
    """Owner of the mode: looks a transition up in the one table, and carries it out.

    Args:
        embodiment: The robot.
        sensing: The newest measurements.
        motion: Mover of the robot.
        plans: Makes rollouts.
        events: Log of the robot's events.
        announce: Sends a message to the operators; never blocks.
        now: The present stamp.
        recordings: Recordings of the driven robot.
    """

    def __init__(
        self,
        embodiment: Embodiment,
        sensing: Sensing,
        motion: Motion,
        plans: Plans,
        events: Events,
        announce: Announce,
        now: Callable[[], Stamp],
        recordings: Recordings,
    ):
        self._recordings = recordings
        self._embodiment, self._sensing, self._motion = embodiment, sensing, motion
        self._plans, self._events, self._now = plans, events, now
        self.previews = Previews(plans)
        self._manoeuvres = Manoeuvres(embodiment, sensing)
        self._stops = Stops(partial(announce, keys.STOP_ACK))
        self._coupling_count = 0
        self._until_standing: list[Command] = []
        self.mode = ControlMode.DISARMED
        self.last_execution: Execution | None = None
        self.path_id = 0
        """Committed path in execution, 0 for none."""

    @property
    def phase(self) -> Phase:
        """Phase of AUTONOMOUS."""
        mover = self._motion.execution or self._motion.manoeuvre
        return mover.phase if mover is not None and self.mode is ControlMode.AUTONOMOUS else Phase.NONE

    @property
    def pace(self) -> float:
        """Speed of executions and manoeuvres as a share of the intended speed."""
        return self._plans.settings.pace

    # Causes -------------------------------------------------------------------------------------

    def stop(self, stop: Stop) -> None:
        """Stop in every mode, whoever asks; a stop that is resent in STOPPED is only acknowledged."""
        if self._stops.receive(stop.stop_id, self._now()):
            why = because(Code.STOPPED_BY, site=stop.site_name)
            self._enter(Action.STOP, why)
            self.tell(EventKind.STOPPED, why, who=stop.site_name)

    def run(self, command: Command, stored: StoredModel | None) -> None:
        """Do an allowed command; its second answer comes as an event.

        Args:
            command: The command.
            stored: The model that the command names; None if it names none.
        """
        action = command.action
        if action is Action.PREVIEW and stored is not None:
            if (replaced := self.previews.begin(command, stored, self._now())) is not None:
                self.fail(replaced, because(Code.REPLACED))
            return
        if action is Action.SET_PACE:
            self._set_pace(command)
            return
        if action in (Action.RECORD, Action.END_RECORDING):
            why_not = self._recordings.run(action, command.task)
            self.complete(command, because(Code.DONE)) if why_not is None else self.fail(command, why_not)
            return
        for overtaken in self._until_standing:
            self.fail(overtaken, because(Code.OVERTAKEN, action=action))
        self._until_standing.clear()
        self._enter(action, because(Code.ENDED_BY, action=action))
        match action:
            case Action.EXECUTE if stored is not None:
                self._execute(command, stored)
            case Action.RETRACT | Action.GO_TO_READY:
                self._motion.begin(self._manoeuvres.make(TABLE[action].phase, command, pace=self.pace))
            case Action.COUPLE:
                self._couple(command)
            case Action.RESUME:
                self.complete(command, because(Code.RESUMED))
            case _:
                self._until_standing.append(command)

    def trip(self, trip: Trip) -> bool:
        """Apply the table's consequence of a guard. Return False if it has no such row."""
        if mode_after(self.mode, self.phase, trip.guard) is None:
            return False
        self._enter(trip.guard, trip.why)
        if (phase := TABLE[trip.guard].phase) is not Phase.NONE:
            self._motion.begin(self._manoeuvres.make(phase, why=trip.why))
        self.tell(_KINDS[trip.guard], trip.why, succeeded=trip.wanted)
        return True

    def force_stopped(self) -> None:
        """Enter STOPPED even if nothing else could be done about it."""
        self._motion.end()
        self.mode, self.path_id = ControlMode.STOPPED, 0

    def arrived(self, execution: Execution) -> None:
        """Note that an execution has reached the end of its motion, and continues tracking."""
        after_s = execution.arrived_after_s or 0.0
        self.complete(execution.command, because(Code.AT_END, elapsed_s=after_s, phase=execution.phase))

    def end_manoeuvre(self, manoeuvre: Manoeuvre) -> None:
        """End a manoeuvre that reached its goal or its time limit."""
        self._motion.end()
        code = Code.MANOEUVRE_ENDED if manoeuvre.reached else Code.MANOEUVRE_GAVE_UP
        ended = because(code, phase=manoeuvre.phase)
        self._enter(Guard.MANOEUVRE_ENDED, ended)
        if manoeuvre.command is None:
            self.tell(
                EventKind.HOLDING, because(Code.HOLDS_AFTER, phase=manoeuvre.phase), cause=manoeuvre.why
            )
        elif manoeuvre.reached:
            self.complete(manoeuvre.command, ended)
        else:
            self.fail(manoeuvre.command, ended)

    def on_standstill(self) -> None:
        """Complete the commands that waited for the robot to stand still, and acknowledge its stops."""
        for command in self._until_standing:
            self.complete(command, because(Code.DONE))
        self._until_standing.clear()
        self._stops.stands(self._now())

    # What happened ------------------------------------------------------------------------------

    def complete(self, command: Command, result: Reason, **fields: Any) -> None:
        """Complete a command."""
        self.tell(
            EventKind.COMPLETED, result, command_id=command.command_id, action=command.action, **fields
        )  # fmt: skip

    def fail(self, command: Command, why: Reason) -> None:
        """Fail a command that was begun."""
        self.tell(
            EventKind.FAILED, why, succeeded=False, command_id=command.command_id, action=command.action
        )  # fmt: skip

    def tell(self, kind: EventKind, reason: Reason, **fields: Any) -> None:
        """Say what happened, with the mode that it led to."""
        self._events.tell(kind, reason, self.mode, **fields)

    # Doing it -----------------------------------------------------------------------------------

    def _enter(self, cause: Cause, why: Reason) -> None:
        """Go where the table says; what moved the robot is paused, goes on, or ends for this reason."""
        target = mode_after(self.mode, self.phase, cause)
        if target is None:
            raise AssertionError(f"{cause} was not checked in {self.mode}")
        self._recordings.leave(cause, why)
        if target is not ControlMode.PAUSED and cause is not Action.RESUME:
            self._leave_motion(why)
        self._motion.paused = target is ControlMode.PAUSED
        if target is not ControlMode.STOPPED:
            self._stops.forget()
        self.mode = target

    def _couple(self, command: Command) -> None:
        self._coupling_count += 1
        now_ns = self._now().t_ns
        round_trip_s = (now_ns - command.echo.t_ns) * 1e-9 if command.echo else 0.0
        self._motion.begin(Coupling(self._coupling_count, command.lease_id, now_ns * 1e-9, round_trip_s))
        self.complete(command, because(Code.COUPLED), coupling_id=self._coupling_count)

    def _set_pace(self, command: Command) -> None:
        """Go at another pace from now on, also in what is under way."""
        self._plans.settings = replace(self._plans.settings, pace=command.pace)
        if (execution := self._motion.execution) is not None:
            execution.go_on_with(self._plans.settings)
            self._plans.forget_commit()
        manoeuvre = self._motion.manoeuvre
        # A manoeuvre without a command serves safety: it is not slowed.
        if manoeuvre is not None and manoeuvre.command is not None:
            manoeuvre.pace = command.pace
        self.complete(command, because(Code.PACE, pace=command.pace))

    def _execute(self, command: Command, stored: StoredModel) -> None:
        now = self._now()
        self._embodiment.skill.begin(stored.task, now.t_ns * 1e-9)
        self.last_execution = Execution(
            command, stored, self._plans.settings, self._embodiment, self._sensing, now
        )
        self._motion.begin(self.last_execution)
        self.tell(
            EventKind.EXECUTING, because(Code.EXECUTING, model=stored.label), command_id=command.command_id
        )
        self._plans.forget_commit()

    def _leave_motion(self, why: Reason) -> None:
        """End whatever moves the robot; the plant brakes from the next tick on."""
        execution, manoeuvre = self._motion.execution, self._motion.manoeuvre
        if execution is not None and execution.arrived_after_s is None:
            self.fail(execution.command, why)
        if manoeuvre is not None and manoeuvre.command is not None:
            self.fail(manoeuvre.command, why)
        self._motion.end()
        self.path_id = 0
