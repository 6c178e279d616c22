"""Demonstrations for display: in the world, relative to where the goal's frame was at their end."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from farhand.local_site.teaching.demonstration import Demonstration

Array = NDArray[np.float64]


@lru_cache(maxsize=64)
def seen_from_goal(demonstration: Demonstration) -> Array:
    """Return a motion's points as if the goal's frame had been at its last place all along.

    Shape (T, C). Orientations are those of the world.
    """
    points = demonstration.points
    if not demonstration.frames_move:
        return points
    A = np.broadcast_to(demonstration.frame_rotation, (*_moving(demonstration), demonstration.n_dims))[:, -1]
    b = np.broadcast_to(demonstration.frame_origin_m, _moving(demonstration))[:, -1]
    local = np.einsum("tji,tj->ti", A, demonstration.position_m - b)
    return np.hstack([local @ A[-1].T + b[-1], points[:, demonstration.n_dims :]])


def _moving(demonstration: Demonstration) -> tuple[int, int, int]:
    """Return the shape of origins that are given for every sample."""
    return demonstration.time_s.size, len(demonstration.frame_names), demonstration.n_dims
