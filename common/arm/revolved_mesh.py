"""Body of revolution as a mesh, for display only: contacts are between boxes and capsules."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from farhand.common.arm.engine import MjcfElement

_SEGMENTS = 64
_SMOOTH = np.cos(np.radians(30.0))
"""Corners of a profile that turn less than this are drawn round."""


def add_revolved_mesh(root: MjcfElement, name: str, profile_m: Sequence[tuple[float, float]]) -> MjcfElement:
    """Add the mesh of a profile turned about z to a model's assets; see `turned`.

    Returns:
        The MJCF element of the mesh.
    """
    vertices, normals, faces = turned(profile_m)
    return root.asset.add(
        "mesh",
        name=name,
        vertex=vertices.ravel(),
        normal=normals.ravel(),
        face=faces.ravel(),
        inertia="shell",
    )


def turned(
    profile_m: Sequence[tuple[float, float]], n_segments: int = _SEGMENTS
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    """Turn a profile about z into a mesh.

    Args:
        profile_m: Radius and height of each corner, with the body to the left of the path along them [m].
        n_segments: Number of flat faces around the axis.

    Returns:
        Vertices (V, 3) [m], their normals (V, 3), and triangles of them (F, 3).
    """
    corners = np.array(profile_m)
    along = np.diff(corners, axis=0)
    outwards = np.stack([along[:, 1], -along[:, 0]], axis=1)
    outwards /= np.linalg.norm(outwards, axis=1, keepdims=True)
    vertices, normals, faces = [], [], []
    for k, normal in enumerate(outwards):
        for corner, neighbour in ((k, k - 1), (k + 1, k + 1)):
            smooth = 0 <= neighbour < len(outwards) and normal @ outwards[neighbour] > _SMOOTH
            vertices.append(_ring(corners[corner], n_segments))
            normals.append(_ring(normal + outwards[neighbour] if smooth else normal, n_segments))
        faces.append(2 * k * n_segments + _band(corners[k, 0] > 0.0, corners[k + 1, 0] > 0.0, n_segments))
    return np.concatenate(vertices), np.concatenate(normals), np.concatenate(faces)


def _ring(point: NDArray[np.float64], n: int) -> NDArray[np.float64]:
    """Return the points of a circle of this radius and height about z. Shape (n, 3)."""
    angle = np.linspace(0.0, 2.0 * np.pi, n, endpoint=False)
    return np.stack([point[0] * np.cos(angle), point[0] * np.sin(angle), np.full(n, point[1])], axis=1)


def _band(starts_open: bool, ends_open: bool, n: int) -> NDArray[np.int64]:
    """Return the triangles between two rings of n points; one ring may be a point. Shape (F, 3)."""
    here = np.arange(n)
    there = np.roll(here, -1)
    faces = []
    if ends_open:
        faces.append(np.stack([here, n + there, n + here], axis=1))
    if starts_open:
        faces.append(np.stack([here, there, n + there], axis=1))
    return np.concatenate(faces)
