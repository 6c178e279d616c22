"""Last guard: an unforeseen error stops the robot, is reported, and ends no process.

Record of the last seconds before a fault, kept in memory and written when a fault happens.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from farhand.common.errors import words_of
from farhand.common.log import loop_logger
from farhand.common.mode_table import ControlMode, Guard
from farhand.common.wire.reasons import Code, Reason, because
from farhand.remote_site.interface.sensing import Sensing
from farhand.remote_site.motion.motion import Motion
from farhand.remote_site.supervision.guards import Trip
from farhand.remote_site.supervision.mode_machine import ModeMachine

_log = loop_logger(__name__)

_KEPT_S = 5.0


class BlackBox:
    """Ring buffer of the measurements of the last seconds.

    Args:
        sensing: The newest measurements.
        motion: Mover of the robot.
        control_hz: Ticks per second [Hz].
        write: Writes one line of a dump, from its fields; never blocks.
    """

    def __init__(self, sensing: Sensing, motion: Motion, control_hz: float, write: Callable[..., None]):
        self._sensing, self._motion, self._write = sensing, motion, write
        self._rows: deque[tuple] = deque(maxlen=max(1, round(_KEPT_S * control_hz)))

    def remember(self, now_s: float, mode: ControlMode) -> None:
        """Remember the measurements of one tick."""
        sensed, execution = self._sensing, self._motion.execution
        self._rows.append(
            (
                now_s,
                mode,
                sensed.effector.position_m,
                sensed.effector.velocity_m_s,
                sensed.goal.b,
                execution.component if execution else -1,
                execution.executor.way if execution else -1,
            )
        )

    def dump(self) -> None:
        """Write the buffer to disk and empty it."""
        for t_s, mode, position, velocity, origin, component, way in self._rows:
            self._write(
                kind="black box", t_s=t_s, mode=mode, position_m=position.tolist(),
                velocity_m_s=velocity.tolist(), frame_origin_m=origin.tolist(), component=component, way=way,
            )  # fmt: skip
        self._rows.clear()


class Failsafe:
    """Runner of every part of a control period, so that no exception leaves the control loop.

    Foreseen faults are handled where they occur; this catches the rest: foreign numerics, a driver, a bug.

    Args:
        motion: Stops the plant.
        machine: Owner of the mode.
        black_box: The last seconds, written down when something fails.
        control_hz: Control periods per second [Hz].
    """

    def __init__(self, motion: Motion, machine: ModeMachine, black_box: BlackBox, control_hz: float):
        self._motion, self._machine, self._black_box, self._dt_s = (
            motion,
            machine,
            black_box,
            1.0 / control_hz,
        )
        self._failed = False

    def run(self, do: Callable[[], None]) -> None:
        """Run a part of a control period; if it fails, the robot brakes, is STOPPED and says why. Never raises.

        Some makers' libraries end the process or cancel their own task when a bus fails: that is an error as well.
        """
        try:
            do()
        except KeyboardInterrupt:
            raise
        except BaseException as error:
            self._motion.halt(self._dt_s)  # before anything is logged or announced
            _log.exception("a control period failed")
            said = self._failed and self._machine.mode is ControlMode.STOPPED
            self._failed = True
            if not said:
                self._stop(because(Code.LOOP_FAILED, text=words_of(error)))

    def _stop(self, why: Reason) -> None:
        try:
            self._machine.trip(Trip(Guard.FAULT, why))
            self._black_box.dump()
        except Exception:
            _log.exception("could not report a failed control period")
            self._machine.force_stopped()
