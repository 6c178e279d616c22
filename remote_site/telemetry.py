"""Robot's report of itself, small enough for a narrow link."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from msgspec import UNSET, UnsetType

from farhand.common.clock import BootClock
from farhand.common.model.task_frame import TaskFrame
from farhand.common.wire.messages import Telemetry
from farhand.remote_site.supervision.supervisor import Supervisor


def rotation_of(frame: TaskFrame) -> tuple[float, ...]:
    """Return a frame's orientation: empty for None, an angle in the plane, a rotation vector in space."""
    if np.array_equal(frame.A, np.eye(frame.n_dims)):
        return ()
    if frame.n_dims == 2:
        return (math.atan2(frame.A[1, 0], frame.A[0, 0]),)
    from scipy.spatial.transform import Rotation

    return tuple(Rotation.from_matrix(frame.A).as_rotvec().tolist())


def numbers_of(frames: Sequence[TaskFrame]) -> tuple[float, ...] | UnsetType:
    """Return origin and rotation of each frame, one after the other, as a report has them; unset for none."""
    if not frames:
        return UNSET
    none = (0.0,) if frames[0].n_dims == 2 else (0.0, 0.0, 0.0)
    return tuple(x for frame in frames for x in (*frame.b.tolist(), *(rotation_of(frame) or none)))


def _cut(text: str, n_bytes: int) -> str:
    """Return the beginning of a text that fits into a number of bytes."""
    return text.encode()[:n_bytes].decode(errors="ignore")


class Reporter:
    """Maker of the reports.

    Args:
        supervisor: Source of the reported state.
        clock: Clock of the robot.
    """

    def __init__(self, supervisor: Supervisor, clock: BootClock):
        self._supervisor, self._clock = supervisor, clock
        self._seq = 0

    def report(self, overruns: int = 0) -> Telemetry:
        """Return the robot's present state.

        Args:
            overruns: Control periods that came too late in this boot.
        """
        self._seq += 1
        s, sensed, contact = self._supervisor, self._supervisor.sensing, self._supervisor.contact
        execution, coupling = s.motion.execution, s.motion.coupling
        now = s.stamp()
        held_ms = (now.t_ns - contact.heartbeat_received_ns) * 1e-6 if contact.heartbeat_seq else 0.0
        newest, recorded_s = s.models.newest, s.recordings.recorded_s
        return Telemetry(
            seq=self._seq,
            stamp=now,
            mode=s.mode,
            phase=s.phase,
            position_m=tuple(sensed.effector.position_m.tolist()),
            frame_origin_m=tuple(sensed.goal.b.tolist()),
            frame_rotation_rad=rotation_of(sensed.goal),
            other_frames=numbers_of(sensed.frames[:-1]),
            component=execution.component if execution else -1,  # also while paused: it can go on
            elapsed_s=execution.elapsed_s if execution else 0.0,
            path_id=s.path_id,
            model=newest.sha256[:8] if newest else "",
            coupling_id=coupling.coupling_id if coupling else 0,
            holder=_cut(contact.lease.holder, 16),
            lease=contact.lease.lease_id[:4],
            heartbeat_echo=contact.heartbeat_seq,
            heartbeat_held_ms=held_ms,
            waiting=coupling is not None and coupling.waiting(self._clock.now_s()),
            stale_refused=contact.stale_refused,
            pace=s.machine.pace,
            arm=s.embodiment.hardware.arm_state(sensed.effector, overruns),
            recorded_s=UNSET if recorded_s is None else recorded_s,
        )
