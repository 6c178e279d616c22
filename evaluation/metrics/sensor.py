"""Model of a sensor that records a hand: noise, another rate, quantised positions, drop-outs, a lost marker.

Studies record their hands by `TRACKER` unless they say otherwise: a marker tracker's white noise of a
millimetre and half a degree.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from farhand.local_site.teaching.demonstration import Demonstration

Array = NDArray[np.float64]

_COLOUR_S = 0.3  # correlation time of coloured noise
_GAP_S = 0.15  # mean length of a drop-out
_LOST_S = (0.02, 0.2)  # duration of a marker's loss


@dataclass(frozen=True)
class Sensor:
    """Sensor that records a hand.

    Args:
        white_m: Standard deviation of white noise of the position, per axis [m].
        white_rad: The same of the orientation [rad].
        coloured_m: Standard deviation of noise that is correlated over 0.3 s, per axis [m].
        coloured_rad: The same of the orientation [rad].
        rate_hz: Samples per second; the hand's own when not given.
        quantum_m: Positions are multiples of this; not quantised when zero [m].
        missing: Share of the time in drop-outs.
        jumps_hz: Losses of a marker per second; a lost marker is reported up to half a metre away.
    """

    white_m: float = 0.0
    white_rad: float = 0.0
    coloured_m: float = 0.0
    coloured_rad: float = 0.0
    rate_hz: float | None = None
    quantum_m: float = 0.0
    missing: float = 0.0
    jumps_hz: float = 0.0

    def record(self, hand: Demonstration, random: np.random.Generator) -> Demonstration:
        """Return the hand's motion as the sensor reports it.

        The first and the last sample are never missing.
        """
        seen = hand if self.rate_hz is None else _at_rate(hand, self.rate_hz)
        time_s, D = seen.time_s, seen.n_dims
        noise, slow = random.normal(size=(time_s.size, 6)), _coloured(random, time_s)
        position = seen.position_m + self.white_m * noise[:, :D] + self.coloured_m * slow[:, :D]
        position = position + self._jumps_m(random, time_s, D)
        if self.quantum_m > 0.0:
            position = self.quantum_m * np.round(position / self.quantum_m)
        quat = seen.quat_wxyz
        if quat is not None:
            turns = Rotation.from_rotvec(self.white_rad * noise[:, 3:] + self.coloured_rad * slow[:, 3:])
            quat = (Rotation.from_quat(quat, scalar_first=True) * turns).as_quat(scalar_first=True)
        return _kept(replace(seen, position_m=position, quat_wxyz=quat), self._present(random, time_s))

    def _jumps_m(self, random: np.random.Generator, time_s: Array, n_dims: int) -> Array:
        """Return the displacement at which a lost marker is reported [m]. Shape (T, D)."""
        away = np.zeros((time_s.size, n_dims))
        for begin_s in random.uniform(time_s[0], time_s[-1], random.poisson(self.jumps_hz * np.ptp(time_s))):
            lost = (time_s >= begin_s) & (time_s < begin_s + random.uniform(*_LOST_S))
            away[lost] = random.uniform(-0.5, 0.5, n_dims)
        return away

    def _present(self, random: np.random.Generator, time_s: Array) -> NDArray[np.bool_]:
        """Mark the samples that are not missing. Shape (T,)."""
        present = np.ones(time_s.size, np.bool_)
        for begin_s in random.uniform(
            time_s[0], time_s[-1], random.poisson(self.missing * np.ptp(time_s) / _GAP_S)
        ):
            present[(time_s >= begin_s) & (time_s < begin_s + random.exponential(_GAP_S))] = False
        present[[0, -1]] = True
        return present


TRACKER = Sensor(white_m=0.001, white_rad=math.radians(0.5))
EXACT = Sensor()


def _at_rate(hand: Demonstration, rate_hz: float) -> Demonstration:
    """Return the same motion at another rate, its last sample kept; its frames stand still."""
    time_s = np.append(np.arange(hand.time_s[0], hand.time_s[-1] - 1e-9, 1.0 / rate_hz), hand.time_s[-1])
    position = np.stack([np.interp(time_s, hand.time_s, axis) for axis in hand.position_m.T], axis=1)
    quat = None
    if hand.quat_wxyz is not None:
        turns = Slerp(hand.time_s, Rotation.from_quat(hand.quat_wxyz, scalar_first=True))(time_s)
        quat = turns.as_quat(scalar_first=True)
    return replace(hand, time_s=time_s, position_m=position, quat_wxyz=quat)


def _coloured(random: np.random.Generator, time_s: Array) -> Array:
    """Return noise of unit variance that is correlated for a while (Ornstein-Uhlenbeck). Shape (T, 6)."""
    out = random.normal(size=(time_s.size, 6))
    for k, keep in enumerate(np.exp(-np.diff(time_s) / _COLOUR_S), start=1):
        out[k] = keep * out[k - 1] + math.sqrt(1.0 - keep**2) * out[k]
    return out


def _kept(demonstration: Demonstration, present: NDArray[np.bool_]) -> Demonstration:
    quat = demonstration.quat_wxyz
    return replace(
        demonstration,
        time_s=demonstration.time_s[present],
        position_m=demonstration.position_m[present],
        quat_wxyz=None if quat is None else quat[present],
    )
