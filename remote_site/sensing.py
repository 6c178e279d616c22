"""What the robot senses each tick: its effector and its task frames."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

from remote_site.perception import Perception
from remote_site.plant import Plant

_MEAN_FRAME_S = 10.0


class Sensing:
    """The newest measurements.

    Args:
        plant: The machine.
        perception: Its surroundings.
        control_hz: How often `update` is called [Hz].
        now_s: Now [s].
    """

    def __init__(self, plant: Plant, perception: Perception, control_hz: float, now_s: float):
        self._plant, self._perception = plant, perception
        self._origins: deque[NDArray[np.float64]] = deque(maxlen=max(1, round(_MEAN_FRAME_S * control_hz)))
        self.update(now_s)

    def update(self, now_s: float) -> None:
        """Measure."""
        self.effector = self._plant.read()
        self.frames = self._perception.observe(now_s)
        self._origins.append(self.frames[0].b)

    def mean_frame_m(self) -> NDArray[np.float64]:
        """The first frame's origin averaged over its movement. Shape (D,) [m]."""
        return np.mean(self._origins, axis=0)
