"""Perception: how the robot's site sees its task frames."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from farhand.common.model.task_frame import TaskFrame


class Perception(Protocol):
    """What the remote site needs to know about its surroundings, local to it and without delay."""

    def observe(self, now_s: float) -> list[TaskFrame] | None:
        """Return the task frames as estimated now, in the order of the task's `frame_names`; None while unseen."""
        ...

    def true_origin_m(self, now_s: float) -> NDArray[np.float64] | None:
        """Return where the first frame really is, None where nobody can know. Shape (D,) [m]."""
        ...
