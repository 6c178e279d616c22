"""A body of revolution as a mesh, for the eye: contacts are between boxes and capsules."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

_SEGMENTS = 64


def add_lathe(root: Any, name: str, profile_m: Sequence[tuple[float, float]]) -> Any:
    """Add the mesh of a profile turned about z to a model's assets.

    Args:
        root: Of the MJCF model.
        name: Of the mesh.
        profile_m: Radius and height of each corner, with the body to the left of the way along them [m].

    Returns:
        The MJCF element of the mesh.
    """
    angle = np.linspace(0.0, 2.0 * np.pi, _SEGMENTS, endpoint=False)
    rings = [
        np.stack([r * np.cos(angle), r * np.sin(angle), np.full(_SEGMENTS, z)], axis=1) for r, z in profile_m
    ]
    here = np.arange(_SEGMENTS)
    there = np.roll(here, -1)
    faces = []
    for ring, ((r, _), (following, _)) in enumerate(pairwise(profile_m)):
        a, b = ring * _SEGMENTS, (ring + 1) * _SEGMENTS
        if following > 0.0:
            faces.append(np.stack([a + here, b + there, b + here], axis=1))
        if r > 0.0:
            faces.append(np.stack([a + here, a + there, b + there], axis=1))
    return root.asset.add(
        "mesh",
        name=name,
        vertex=np.concatenate(rings).ravel(),
        face=np.concatenate(faces).ravel(),
        inertia="shell",
    )
