"""Perception: interface to the robot's sight of its task frames."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from farhand.common.model.task_frame import TaskFrame


class Perception(Protocol):
    """Sight of the surroundings, local to the remote site and without delay."""

    def observe(self, now_s: float) -> list[TaskFrame] | None:
        """Return the task frames as estimated now, in the order of the task's `frame_names`; None while unseen."""
        ...

    def true_origin_m(self, now_s: float) -> NDArray[np.float64] | None:
        """Return the true origin of the first frame, None if nobody can know it. Shape (D,) [m]."""
        ...
