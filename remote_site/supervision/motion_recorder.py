"""Recorder of a driven motion: up to 100 samples per second, each with the task frames as perceived at its time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from farhand.common.task import AnyTask
from farhand.common.wire.messages import Stamp
from farhand.common.wire.motion_encoding import MAX_DURATION_S, MAX_GAP_S, RecordedMotion, packed_row
from farhand.common.wire.reasons import Code, Reason, because
from farhand.remote_site.interface.sensing import PREDICTED_S, Sensing
from farhand.remote_site.motion.coupling import Coupling

_SAMPLE_HZ = 100.0


@dataclass(frozen=True)
class Recorded:
    """Recorded motion after its end.

    Args:
        motion: The motion.
        site_name: Name of the driving operator's site.
        duration_s: Time from the first to the last sample [s].
        whole: True if the driving operator ended it, False if anything else did.
    """

    motion: RecordedMotion
    site_name: str
    duration_s: float
    whole: bool


class MotionRecorder:
    """Recorder of at most one motion at a time; it begins with the first input of the driving hand.

    Args:
        sensing: The newest measurements.
        control_hz: Calls of `sample` per second [Hz].
        now: The present stamp.
    """

    def __init__(self, sensing: Sensing, control_hz: float, now: Callable[[], Stamp]):
        self._sensing, self._now = sensing, now
        self._every = max(1, round(control_hz / _SAMPLE_HZ))
        self.recording = False
        self._clear()

    def begin(self, site_name: str, task: AnyTask) -> None:
        """Begin a recording.

        Args:
            site_name: Name of the driving operator's site.
            task: Task that the motion demonstrates.
        """
        self._clear(site_name, task)
        self.recording = True

    @property
    def recorded_s(self) -> float:
        """Duration up to the newest sample [s]; zero before the first."""
        return self._last_s

    def sample(self, coupling: Coupling) -> Reason | None:
        """Take a sample, if one is due.

        Args:
            coupling: Coupling through which the operator drives.

        Returns:
            Reason why the recording cannot continue; None while it can.
        """
        now = self._now()
        if self._began is None:
            if coupling.waiting(now.t_ns * 1e-9):
                return None
            self._began = now
        time_s = (now.t_ns - self._began.t_ns) * 1e-9
        if (gap_s := time_s - self.recorded_s) > MAX_GAP_S:
            return because(Code.SAMPLE_MISSING, gap_s=gap_s)
        if time_s > MAX_DURATION_S:
            return because(Code.RECORDING_TOO_LONG, limit_s=MAX_DURATION_S)
        self._ticks += 1
        # For a moment without sight the frames are predicted; after that they are unknown.
        if self._ticks % self._every == 0 and self._sensing.unseen_s <= PREDICTED_S:
            self._rows += packed_row(time_s, self._sensing.effector.point, self._sensing.frames)
            self._n, self._last_s = self._n + 1, time_s
        return None

    def close(self, whole: bool) -> Recorded | None:
        """End the recording and return it; None when it is empty.

        Args:
            whole: True if the driving operator ended it.
        """
        began, task, rows, site_name = self._began, self._task, bytes(self._rows), self._site_name
        duration_s, n = self.recorded_s, self._n
        self._clear()
        self.recording = False
        if began is None or task is None or n < 2:
            return None
        motion = RecordedMotion(
            task=task.name, frame_names=task.frame_names, n_dims=task.space.n_dims,
            oriented=task.space.oriented, began=began, rows=rows,
        )  # fmt: skip
        return Recorded(motion, site_name, duration_s, whole)

    def _clear(self, site_name: str = "", task: AnyTask | None = None) -> None:
        self._site_name, self._task = site_name, task
        self._rows, self._n, self._ticks = bytearray(), 0, -1
        self._began: Stamp | None = None
        self._last_s = 0.0
