"""Checks of a plant and of a perception; public as `farhand.testing`."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from farhand.common.errors import InvalidInput
from farhand.remote_site.interface.driver import Haltable
from farhand.remote_site.interface.plant import EffectorState, Plant, check_state
from farhand.remote_site.interface.sensing import Perception, TrueTarget, check_frames
from farhand.testing.findings import check_times, findings, opened

Pace = Callable[[float], object]

_REST_M_S = 2e-3
_PATIENCE, _PATIENCE_S = 4.0, 0.5  # a motion may take so many times the ideal duration, and so much longer
_SPAN = 5  # control periods over which an acceleration is measured


def check_plant(
    plant: Plant,
    *,
    max_speed_m_s: float,
    max_acceleration_m_s2: float,
    dt_s: float = 0.02,
    room_m: float = 0.3,
    pace: Pace = time.sleep,
) -> None:
    """Check a plant: form and copies of its readings, driving, accelerating, limits, braking, halting.

    Args:
        plant: Plant that has not been started; it is started, halted and closed as far as it can be.
        max_speed_m_s: Speed limit of its task [m/s].
        max_acceleration_m_s2: Acceleration limit of its task [m/s^2].
        dt_s: Control period [s].
        room_m: Free way along the first axis, from its place in the positive direction [m].
        pace: Waits for the next period; `lambda _: None` lets a simulation run at once.

    Raises:
        AssertionError: With a line for each finding.
        InvalidInput: When the room is too small for the limits.
    """
    least_m = 2.5 * max_speed_m_s**2 / max_acceleration_m_s2
    if room_m < least_m:
        raise InvalidInput(
            "check_plant", "room_m", f"{least_m:.3g} m or more for these limits, got {room_m:g}"
        )
    with findings("plant") as told, opened(plant, told, "read", "accelerate", "follow", "brake"):
        trial = _Trial(plant, max_speed_m_s, max_acceleration_m_s2, dt_s, pace, told)
        trial.reads()
        trial.follows(0.5 * room_m)
        trial.accelerates(0.25 * room_m)
        trial.keeps_limits()
        trial.halts()
        check_times(told, trial.durations_s, dt_s)


def check_perception(
    perception: Perception,
    *,
    n_frames: int = 1,
    n_dims: int = 2,
    dt_s: float = 0.02,
    duration_s: float = 2.0,
    pace: Pace = time.sleep,
) -> None:
    """Check a perception while its target is in view: form of the frames, and whether it ever sees them.

    Args:
        perception: Perception that has not been started; it is started and closed as far as it can be.
        n_frames: Number P of task frames of its task.
        n_dims: Dimension D of its task; 3 for poses.
        dt_s: Control period [s].
        duration_s: Time to look [s].
        pace: Waits for the next period; `lambda _: None` lets a simulation run at once.

    Raises:
        AssertionError: With a line for each finding.
    """
    with findings("perception") as told, opened(perception, told, "observe"):
        began_s, seen, durations_s = time.monotonic(), False, []
        for n in range(max(1, round(duration_s / dt_s))):
            now_s, before_s = began_s + n * dt_s, time.perf_counter()
            frames = perception.observe(now_s)
            durations_s.append(time.perf_counter() - before_s)
            if frames is not None:
                check_frames(frames, n_frames, n_dims)
                seen = True
            _check_truth(perception, now_s, n_dims)
            pace(dt_s)
        if not seen:
            told.append("observe: it saw nothing: put its target in view, or give it more time (duration_s)")
        check_times(told, durations_s, dt_s)


class _Trial:
    """Motions of a plant, in this order."""

    def __init__(
        self, plant: Plant, speed_m_s: float, acceleration_m_s2: float, dt_s: float, pace: Pace, told: list[str]
    ):  # fmt: skip
        self._plant, self._speed, self._acceleration = plant, speed_m_s, acceleration_m_s2
        self._dt_s, self._pace, self._told = dt_s, pace, told
        self._shape = (0, 0)
        self.durations_s: list[float] = []

    def reads(self) -> None:
        state = self._plant.read()
        if not isinstance(state, EffectorState):
            check_state(state, 0, 0)
        self._shape = np.size(state.point), np.size(state.velocity)
        _ = self._read().n_dims  # refuses what is neither a position nor a pose
        self._rests("at the beginning")

    def follows(self, distance_m: float) -> None:
        """Drive forth at half the speed."""
        began, limit_m_s, fastest_m_s = self._read(), 0.5 * self._speed, 0.0
        kept, goal = began.position_m.copy(), began.controlled[0].copy()
        goal[0] += distance_m
        for _ in range(self._periods(distance_m / limit_m_s)):
            self._do(lambda: self._plant.follow(goal.copy(), limit_m_s, self._dt_s))
            fastest_m_s = max(fastest_m_s, self._fast())
        position = self._read().position_m
        off_m, moved_m = math.dist(position, goal[: len(position)]), math.dist(position, kept)
        if not np.array_equal(began.position_m, kept):
            self._told.append("read: a reading changes when the robot moves on: return copies")
        if off_m > 0.2 * distance_m:
            self._told.append(
                f"follow: {off_m:.3f} m from a goal {distance_m:g} m away; it moved {moved_m:.3f} m"
            )
        if fastest_m_s > 1.1 * limit_m_s:
            self._told.append(f"follow: {fastest_m_s:.2f} m/s, told to keep below {limit_m_s:.2f}")
        self._rests("after follow")

    def accelerates(self, distance_m: float) -> None:
        """Accelerate back at half the limit, over half the distance."""
        wanted = 0.5 * self._acceleration
        n = max(2, round(min(math.sqrt(distance_m / wanted), self._speed / wanted) / self._dt_s))
        before = self._velocity()
        for _ in range(n):
            self._accelerate(-wanted)
        got, asked = float((self._velocity() - before)[0]), -wanted * n * self._dt_s
        if abs(got - asked) > 0.3 * abs(asked):
            self._told.append(
                f"accelerate: changed the speed by {got:.3f} m/s where {asked:.3f} was asked for"
            )
        self._rests("after accelerate")

    def keeps_limits(self) -> None:
        """Ask for three times the acceleration, for longer than the speed allows."""
        n = math.ceil(1.5 * self._speed / self._acceleration / self._dt_s)
        velocities = [self._velocity()]
        for _ in range(n):
            self._accelerate(3.0 * self._acceleration)
            velocities.append(self._velocity())
        fastest = max(float(np.linalg.norm(v)) for v in velocities)
        if fastest > 1.1 * self._speed:
            self._told.append(f"accelerate: {fastest:.2f} m/s, above the limit of {self._speed:g}")
        spans = zip(velocities, velocities[_SPAN:], strict=False)
        change = max((float(np.linalg.norm(v - u)) for u, v in spans), default=0.0) / (_SPAN * self._dt_s)
        if change > 1.25 * self._acceleration:
            self._told.append(f"accelerate: {change:.1f} m/s^2, above the limit of {self._acceleration:g}")
        self._rests("from full speed")

    def halts(self) -> None:
        if isinstance(self._plant, Haltable):
            self._plant.halt()
            self._plant.halt()
            self._rests("after halt")

    def _rests(self, when: str) -> None:
        """Brake until it stands, and see that it stays."""
        for _ in range(self._periods(self._fast() / self._acceleration)):
            self._do(lambda: self._plant.brake(self._dt_s))
        if (speed := self._fast()) > _REST_M_S:
            self._told.append(f"brake: still {speed:.3f} m/s {when}")

    def _do(self, command: Callable[[], None]) -> None:
        before_s = time.perf_counter()
        command()
        self._read()
        self.durations_s.append(time.perf_counter() - before_s)
        self._pace(self._dt_s)

    def _accelerate(self, along_m_s2: float) -> None:
        acceleration = np.zeros(self._read().velocity.size)
        acceleration[0] = along_m_s2
        self._do(lambda: self._plant.accelerate(acceleration, self._dt_s))

    def _read(self) -> EffectorState:
        """Return a reading that is of the agreed form, as the first one was."""
        state = self._plant.read()
        check_state(state, *self._shape)
        if not state.is_plausible:
            raise InvalidInput("plant", "read", "finite numbers only, and none beyond a million")
        return state

    def _velocity(self) -> NDArray[np.float64]:
        state = self._read()
        return state.controlled[1][: state.n_dims].copy()  # what accelerations change

    def _fast(self) -> float:
        return float(np.linalg.norm(self._read().velocity_m_s))

    def _periods(self, ideal_s: float) -> int:
        return math.ceil((_PATIENCE * ideal_s + _PATIENCE_S) / self._dt_s)


def _check_truth(perception: Perception, now_s: float, n_dims: int) -> None:
    origin_m = perception.true_origin_m(now_s) if isinstance(perception, TrueTarget) else None
    if origin_m is not None and (np.shape(origin_m) != (n_dims,) or not np.isfinite(origin_m).all()):
        raise InvalidInput("perception", "true_origin_m", f"{n_dims} finite numbers or None, got {origin_m}")
