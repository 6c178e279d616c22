"""Disturbances of the robot's work: sway, a step, a current, a push, and how they appear to the vehicle.

Pure functions of time and a seed, in the axes of the earth. A motion of the receptacle or the vehicle is a tangent of
`farhand.common.model.manifold.POSE` at the pose at rest.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from farhand.common.arm.cell import Cell
from farhand.common.arm.kinematics import AT_ORIGIN, compose, inverse, rotation
from farhand.common.arm.simulation.receptacle import FACING_QUAT
from farhand.common.errors import InvalidConfiguration
from farhand.common.model.manifold import POSE

Array = NDArray[np.float64]

# Earliest and latest beginning of a step and a push: during the usual insertion [s].
_STEP_FROM_S, _PUSH_FROM_S = (3.0, 6.0), (2.0, 6.0)
# Variation of the current's speed and direction [share of the speed, rad], and range of its periods [s].
_GUST, _VEER_RAD, _GUST_S = 0.25, 0.25, (6.0, 25.0)


@dataclass(frozen=True)
class Sway:
    """Harmonic oscillation along and about a line.

    Args:
        amplitude_m: Amplitude of the position [m].
        hz: Frequency [Hz].
        amplitude_rad: Amplitude of the orientation [rad].
    """

    amplitude_m: float = 0.0
    hz: float = 0.1
    amplitude_rad: float = 0.0


@dataclass(frozen=True)
class DisturbanceSettings:
    """Amplitudes of the disturbances.

    Args:
        receptacle: Sway of the receptacle.
        vehicle: Sway of the vehicle that carries the arm.
        step_m: Distance of the receptacle's single, lasting step [m].
        step_for_s: Duration of the step [s].
        step_at_s: Time of its beginning [s]; random when not given.
        current_m_s: Mean speed of the water [m/s].
        push_n: Largest force of a single push on the arm's hand [N].
        push_for_s: Duration of the push [s].

    Raises:
        InvalidConfiguration: When a number is negative or not finite, or a duration is zero.
    """

    receptacle: Sway = Sway()
    vehicle: Sway = Sway()
    step_m: float = 0.0
    step_for_s: float = 0.3
    step_at_s: float | None = None
    current_m_s: float = 0.0
    push_n: float = 0.0
    push_for_s: float = 0.5

    def __post_init__(self) -> None:
        numbers = {name: value for name, value in vars(self).items() if not isinstance(value, Sway)}
        for of in ("receptacle", "vehicle"):
            numbers |= {f"{of}.{name}": value for name, value in vars(getattr(self, of)).items()}
        for name, value in numbers.items():
            least = math.nextafter(0.0, 1.0) if name.endswith("for_s") else 0.0
            if value is not None and not least <= value < math.inf:
                raise InvalidConfiguration("disturbances", name, f"zero or more, got {value}")


CALM = DisturbanceSettings()
TYPICAL = DisturbanceSettings(receptacle=Sway(0.020, 0.1), current_m_s=0.3)
ROUGH = DisturbanceSettings(receptacle=Sway(0.050, 0.2), step_m=0.05, current_m_s=0.8, push_n=20.0)
PRESETS = {"calm": CALM, "typical": TYPICAL, "rough": ROUGH}


class Disturbances:
    """Disturbances as functions of time; equal seeds give equal disturbances.

    Args:
        settings: Amplitudes.
        seed: Seed of directions, phases and times.
    """

    def __init__(self, settings: DisturbanceSettings, seed: int | Sequence[int]):
        random = np.random.default_rng(seed)
        self.settings, self._seed = settings, seed
        # All are drawn in any case, so that a seed gives the same random numbers in all settings.
        self._receptacle = _Swaying(settings.receptacle, random)
        self._vehicle = _Swaying(settings.vehicle, random)
        self._step, self._push = _direction(random), _direction(random)
        step_s, self._push_s = random.uniform(*_STEP_FROM_S), random.uniform(*_PUSH_FROM_S)
        self._step_s = step_s if settings.step_at_s is None else settings.step_at_s
        self._heading_rad = random.uniform(0.0, 2.0 * np.pi)
        self._gust_hz = 1.0 / random.uniform(*_GUST_S, (2, 3))  # phases of the speed and of the heading
        self._gust_phases = random.uniform(0.0, 2.0 * np.pi, (2, 3))

    def stepping_at(self, time_s: float) -> Disturbances:
        """Return the same disturbances, but with the step at a given time [s]."""
        return Disturbances(replace(self.settings, step_at_s=time_s), self._seed)

    def receptacle(self, time_s: float) -> Array:
        """Return the displacement of the receptacle from rest [m, rad]. Shape (6,)."""
        moved = self._receptacle.at(time_s)
        moved[:3] += self.settings.step_m * self._stepped(time_s) * self._step
        return moved

    def vehicle(self, time_s: float) -> Array:
        """Return the displacement of the vehicle from rest [m, rad]. Shape (6,)."""
        return self._vehicle.at(time_s)

    def current_m_s(self, time_s: float) -> Array:
        """Return the velocity of the water; it is horizontal [m/s]. Shape (3,)."""
        if not self.settings.current_m_s:
            return np.zeros(3)
        swing = np.sin(2.0 * np.pi * self._gust_hz * time_s + self._gust_phases).mean(axis=1)
        speed = self.settings.current_m_s * (1.0 + _GUST * swing[0])
        heading = self._heading_rad + _VEER_RAD * swing[1]
        return speed * np.array([np.cos(heading), np.sin(heading), 0.0])

    def push_n(self, time_s: float) -> Array:
        """Return the force on the hand [N]. Shape (3,)."""
        part = (time_s - self._push_s) / self.settings.push_for_s
        if not 0.0 < part < 1.0:
            return np.zeros(3)
        return self.settings.push_n * math.sin(math.pi * part) ** 2 * self._push

    def _stepped(self, time_s: float) -> float:
        part = min(max((time_s - self._step_s) / self.settings.step_for_s, 0.0), 1.0)
        return part**3 * (10.0 - 15.0 * part + 6.0 * part**2)  # minimum jerk


class _Swaying:
    """Sway along and about random lines."""

    def __init__(self, sway: Sway, random: np.random.Generator):
        self._along = sway.amplitude_m * _direction(random)
        self._about = sway.amplitude_rad * _direction(random)
        self._phases = random.uniform(0.0, 2.0 * np.pi, 2)
        self._rad_s = 2.0 * math.pi * sway.hz
        self._rests = sway.amplitude_m == sway.amplitude_rad == 0.0

    def at(self, time_s: float) -> Array:
        if self._rests:
            return np.zeros(6)
        swing, turn = np.sin(self._rad_s * time_s + self._phases)
        return np.concatenate([swing * self._along, turn * self._about])


def _direction(random: np.random.Generator) -> Array:
    vector = random.normal(size=3)
    return vector / np.linalg.norm(vector)


@dataclass(frozen=True, eq=False)
class Surroundings:
    """Disturbances of the arm at one time, in the axes of the earth, z up.

    Args:
        receptacle: Pose to which its spring pulls the receptacle. Shape (7,).
        vehicle: Pose of the vehicle under the arm's base. Shape (7,).
        current_m_s: Velocity of the water. Shape (3,).
        push_n: Force on the hand. Shape (3,).

    Raises:
        InvalidInput: When a pose is not one.
    """

    receptacle: Array
    vehicle: Array = field(default_factory=AT_ORIGIN.copy)
    current_m_s: Array = field(default_factory=lambda: np.zeros(3))
    push_n: Array = field(default_factory=lambda: np.zeros(3))

    def __post_init__(self) -> None:
        for name in ("receptacle", "vehicle"):
            object.__setattr__(self, name, POSE.checked(getattr(self, name), "surroundings", name))

    @classmethod
    def still(cls, cell: Cell) -> Surroundings:
        """Return surroundings at rest, the receptacle facing the arm at its first place."""
        return cls(np.concatenate([cell.robot.workplace.middle_m, FACING_QUAT]))

    def with_receptacle(self, pose: Array) -> Surroundings:
        """Return a copy with the receptacle at another place."""
        return replace(self, receptacle=pose)

    def receptacle_from_vehicle(self) -> Array:
        """Return the receptacle's pose in the vehicle's axes. Shape (7,)."""
        return compose(inverse(self.vehicle), self.receptacle)

    def to_vehicle(self, vector: Array) -> Array:
        """Turn a vector from the earth's axes into the vehicle's. Shape (3,)."""
        return self._earth @ vector

    @cached_property
    def _earth(self) -> Array:
        """Return the earth's axes in the vehicle's. Shape (3, 3)."""
        return rotation(self.vehicle).T
