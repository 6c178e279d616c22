"""Synthetic task like the paper's hot-stab: approach a receptacle along its axis, as a hand would.

In the receptacle's frame the mouth is the origin and the axis points outwards along z, so the tool comes from
above. A hand first reaches for a point before the mouth and then moves straight down the axis: two
overlapping minimum-jerk strokes (Flash and Hogan 1985). It varies as hands do: height of the point before the
mouth, duration, a slow deviation that fades towards the mouth, and end point. With orientations, it starts
rotated at random, and turns the tool into the axis while it reaches.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from farhand.common.model.task_frame import TaskFrame
from farhand.evaluation.metrics.sensor import TRACKER, Sensor
from farhand.local_site.teaching.demonstration import Demonstration

Array = NDArray[np.float64]

FRAME_NAME = "receptacle"
AXIS = np.array([0.0, 0.0, 1.0])
LAMBDA_M = 0.10  # the paper's
N_DEMONSTRATIONS = 5  # the paper's

_PERIOD_S = 0.02
_REACH_S, _APPROACH_S, _OVERLAP_S = 4.5, 3.0, 0.5
_DURATION_SPREAD = 0.1  # of the logarithm
_HEIGHT_M = (0.12, 0.18)  # where the straight approach begins
_DEVIATION_M = 0.010  # of the reach, by its first harmonic
_TREMOR_M = 0.0015  # the same beside the axis
_END_M = 0.001  # of the end, per axis
_TURNED_RAD = 0.6  # of the tool at the start, at most
_TURN_STD_RAD = 0.01  # of the tool at the end, per axis


@dataclass(frozen=True)
class StartBox:
    """Region in which motions may start, in the receptacle's frame.

    Args:
        low: Least coordinates [m]. Length 3.
        high: Largest coordinates [m]. Length 3.
    """

    low: tuple[float, float, float]
    high: tuple[float, float, float]

    def sample(self, random: np.random.Generator) -> Array:
        """Draw a point in it [m]. Shape (3,)."""
        return random.uniform(self.low, self.high)


TAUGHT_STARTS = StartBox((-0.3, -0.3, 0.35), (0.3, 0.3, 0.65))  # where demonstrations start
FAR_STARTS = StartBox((-0.5, -0.5, 0.2), (0.5, 0.5, 0.8))  # where the robot may have to


def random_frame(random: np.random.Generator, reach_m: float = 0.3, turn_rad: float = 0.7) -> TaskFrame:
    """Draw a receptacle within a cube of this half edge, rotated by up to this angle."""
    return TaskFrame(
        random_rotation(random, random.uniform(0.0, turn_rad)), random.uniform(-reach_m, reach_m, 3)
    )


def random_rotation(random: np.random.Generator, angle_rad: float) -> Array:
    """Return a rotation by an angle about a random axis. Shape (3, 3)."""
    return Rotation.from_rotvec(angle_rad * random_direction(random)).as_matrix()


def random_direction(random: np.random.Generator) -> Array:
    """Draw a unit vector, uniformly distributed. Shape (3,)."""
    vector = random.normal(size=3)
    return vector / np.linalg.norm(vector)


def turned_tool(random: np.random.Generator) -> Array:
    """Draw the tool's orientation at the start, in the receptacle's frame. Shape (4,)."""
    angle = random.uniform(0.0, _TURNED_RAD)
    return Rotation.from_rotvec(angle * random_direction(random)).as_quat(scalar_first=True)


def demonstrate(
    random: np.random.Generator, start: Array, frame: TaskFrame, oriented: bool = False
) -> Demonstration:
    """Return one demonstration by the synthetic hand.

    Args:
        random: Random generator of the hand's variation.
        start: Start in the receptacle's frame [m]. Shape (3,).
        frame: The receptacle.
        oriented: Whether with orientations.
    """
    time_s, local = _hand(random, np.asarray(start, dtype=float))
    quat = None
    if oriented:
        turns = _turning(random, time_s / time_s[-1])
        quat = (Rotation.from_matrix(frame.A) * turns).as_quat(scalar_first=True)
    return Demonstration(
        time_s=time_s,
        position_m=frame.to_world(local),
        frame_origin_m=frame.b[None],
        frame_rotation=frame.A[None],
        frame_names=(FRAME_NAME,),
        quat_wxyz=quat,
        source="synthetic approach",
    )


def demonstrations(
    random: np.random.Generator,
    n: int = N_DEMONSTRATIONS,
    oriented: bool = False,
    sensor: Sensor = TRACKER,
) -> list[Demonstration]:
    """Return demonstrations from random starts; the receptacle differs in each, but not by much.

    The sensor's noise has random numbers of its own: the hands are the same whatever records them.
    """
    noises = random.spawn(n)
    hands = [
        demonstrate(
            random, TAUGHT_STARTS.sample(random), random_frame(random, reach_m=0.1, turn_rad=0.25), oriented
        )
        for _ in range(n)
    ]
    return [sensor.record(hand, noise) for hand, noise in zip(hands, noises, strict=True)]


def _hand(random: np.random.Generator, start: Array) -> tuple[Array, Array]:
    """Return times (T,) [s] and positions in the receptacle's frame (T, 3) [m]."""
    slowness = float(np.exp(random.normal(0.0, _DURATION_SPREAD)))
    reach_s, approach_s, overlap_s = (slowness * s for s in (_REACH_S, _APPROACH_S, _OVERLAP_S))
    height = random.uniform(*_HEIGHT_M)
    path, reach_m = _path(start, height * AXIS)
    time_s = np.arange(0.0, reach_s + approach_s - overlap_s + 0.5 * _PERIOD_S, _PERIOD_S)
    reached = minimum_jerk(time_s / reach_s)
    approached = minimum_jerk((time_s - reach_s + overlap_s) / approach_s)
    travelled = reach_m * reached + height * approached
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    position = np.stack([np.interp(travelled, along, axis) for axis in path.T], axis=1)
    position += _wander(random, reached, _DEVIATION_M) + _wander(random, approached, _TREMOR_M)
    return time_s, position + approached[:, None] * random.normal(0.0, _END_M, 3)


def _path(start: Array, before: Array) -> tuple[Array, float]:
    """Return a curve that comes in along the axis, then the axis itself; and the curve's length [m]."""
    s = np.linspace(0.0, 1.0, 400)[:, None]
    away = start + 0.3 * (before - start)
    above = before + 0.4 * float(np.linalg.norm(start - before)) * AXIS
    curve = (1 - s) ** 3 * start + 3 * (1 - s) ** 2 * s * away + 3 * (1 - s) * s**2 * above + s**3 * before
    length = float(np.linalg.norm(np.diff(curve, axis=0), axis=1).sum())
    return np.vstack([curve, (1 - s[1:]) * before]), length


def _wander(random: np.random.Generator, part: Array, amplitude_m: float) -> Array:
    """Return a slow deviation that vanishes at both ends of a stroke [m]. Shape (T, 3)."""
    harmonics = np.arange(1, 4)
    amplitudes = random.normal(0.0, amplitude_m, (3, 3)) / harmonics[:, None]
    return np.sin(np.pi * part[:, None] * harmonics) @ amplitudes


def _turning(random: np.random.Generator, part: Array) -> Rotation:
    """Return the tool's rotations in the receptacle's frame, aligned after two thirds of the time.

    T of them.
    """
    first = Rotation.from_quat(turned_tool(random), scalar_first=True).as_rotvec()
    last = random.normal(0.0, _TURN_STD_RAD, 3)
    turned = minimum_jerk(1.5 * part)[:, None]
    return Rotation.from_rotvec((1.0 - turned) * first + turned * last)


def minimum_jerk(tau: Array) -> Array:
    """Return the fraction of a stroke travelled at a fraction of its time."""
    tau = np.clip(tau, 0.0, 1.0)
    return tau**3 * (10.0 - 15.0 * tau + 6.0 * tau**2)
