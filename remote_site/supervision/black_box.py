"""Record of the last seconds before a fault, kept in memory and written when a fault happens."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from farhand.common.control_mode import ControlMode
from farhand.remote_site.interface.sensing import Sensing
from farhand.remote_site.motion.motion import Motion

_KEPT_S = 5.0


class BlackBox:
    """Remembers what was sensed in each tick.

    Args:
        sensing: The newest measurements.
        motion: What moves the robot.
        control_hz: Ticks per second [Hz].
        write: Writes one line of a dump, from its fields; never blocks.
    """

    def __init__(self, sensing: Sensing, motion: Motion, control_hz: float, write: Callable[..., None]):
        self._sensing, self._motion, self._write = sensing, motion, write
        self._rows: deque[tuple] = deque(maxlen=max(1, round(_KEPT_S * control_hz)))

    def remember(self, now_s: float, mode: ControlMode) -> None:
        """Take one tick."""
        sensed, execution = self._sensing, self._motion.execution
        self._rows.append(
            (
                now_s,
                mode,
                sensed.effector.position_m,
                sensed.effector.velocity_m_s,
                sensed.frames[0].b,
                execution.component if execution else -1,
                execution.executor.way if execution else -1,
            )
        )

    def dump(self) -> None:
        """Write all of it down, and begin anew."""
        for t_s, mode, position, velocity, origin, component, way in self._rows:
            self._write(
                kind="black box", t_s=t_s, mode=mode, position_m=position.tolist(),
                velocity_m_s=velocity.tolist(), frame_origin_m=origin.tolist(), component=component, way=way,
            )  # fmt: skip
        self._rows.clear()
