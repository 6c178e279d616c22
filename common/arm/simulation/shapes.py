"""Triangles of every kind of geom, for drawing; a mesh with too much detail becomes its convex hull."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from farhand.common.arm.engine import MjModel, mujoco
from farhand.common.arm.revolved_mesh import turned

Array = NDArray[np.float64]
Shape = tuple[Array, NDArray[np.int64]]
"""Vertices (V, 3) [m] and triangles of them (F, 3)."""

_FEW_CORNERS = 50
"""Largest number of corners of a mesh beside which what is round is coarse as well."""
_PLATE_M = 0.5


@dataclass(frozen=True)
class _Round:
    """Detail of what is round.

    Args:
        sides: Number of flat faces around a cylinder.
        rings: Number of rings of half a sphere.
    """

    sides: int
    rings: int

    def turned(self, profile_m: list[tuple[float, float]]) -> Shape:
        vertices, _, faces = turned(profile_m, self.sides)
        return vertices, faces

    def cap(self, r: float, z: float, side: float) -> list[tuple[float, float]]:
        """Return the profile of half a sphere around a height: the lower one from its pole, the upper one to it."""
        angles = np.linspace(0.0, 0.5 * np.pi, self.rings)
        arc = [(float(r * np.cos(a)), float(z + side * r * np.sin(a))) for a in angles[:-1]]
        pole = (0.0, float(z + side * r))
        return [*arc, pole] if side > 0.0 else [pole, *arc[::-1]]


_FINE, _COARSE = _Round(20, 6), _Round(8, 3)


def shape_of(model: MjModel, geom: int, most_corners: int | None = None) -> Shape:
    """Return the shape of a geom in the geom's own axes.

    Args:
        model: Model of the geom.
        geom: Its number.
        most_corners: Number of corners from which a mesh is replaced by its convex hull; None for never.
    """
    round_ = _COARSE if most_corners is not None and most_corners <= _FEW_CORNERS else _FINE
    r, half, _ = size = model.geom_size[geom]
    match mujoco.mjtGeom(int(model.geom_type[geom])).name:
        case "mjGEOM_MESH":
            vertices, faces = _asset(model, int(model.geom_dataid[geom]))
            return (
                (vertices, faces)
                if most_corners is None or len(vertices) <= most_corners
                else _hull(vertices, most_corners)
            )
        case "mjGEOM_CYLINDER":
            return round_.turned([(0.0, -half), (r, -half), (r, half), (0.0, half)])
        case "mjGEOM_SPHERE":
            return round_.turned(round_.cap(r, 0.0, -1.0) + round_.cap(r, 0.0, 1.0)[1:])
        case "mjGEOM_CAPSULE":
            return round_.turned(round_.cap(r, -half, -1.0) + round_.cap(r, half, 1.0))
        case "mjGEOM_ELLIPSOID":
            vertices, faces = round_.turned(round_.cap(1.0, 0.0, -1.0) + round_.cap(1.0, 0.0, 1.0)[1:])
            return vertices * size, faces
        case "mjGEOM_PLANE":  # drawn as a plate; without a size it is infinite
            return _box(np.array([size[0] or _PLATE_M, size[1] or _PLATE_M, 1e-3]))
        case _:  # a box, or a height field by the box around it
            centre, half_edges = np.split(model.geom_aabb[geom], 2)
            vertices, faces = _box(half_edges)
            return vertices + centre, faces


def _hull(vertices: Array, n_corners: int) -> Shape:
    """Return the convex hull of the outermost points in a number of directions."""
    k = np.arange(n_corners) + 0.5
    polar, azimuth = np.arccos(1.0 - 2.0 * k / n_corners), np.pi * (1.0 + np.sqrt(5.0)) * k
    directions = np.stack([np.cos(azimuth) * np.sin(polar), np.sin(azimuth) * np.sin(polar), np.cos(polar)])
    corners = np.unique(vertices[np.argmax(vertices @ directions, axis=0)], axis=0)
    try:
        hull = ConvexHull(corners)
    except QhullError:  # flat: nothing to see from the side
        return _box(0.5 * np.ptp(vertices, axis=0))
    a, b, c = (corners[hull.simplices[:, k]] for k in range(3))
    inwards = (np.cross(b - a, c - a) * hull.equations[:, :3]).sum(axis=1) < 0.0
    faces = np.where(inwards[:, None], hull.simplices[:, ::-1], hull.simplices)
    return corners[faces].reshape(-1, 3), np.arange(3 * len(faces)).reshape(-1, 3)  # sharp edges


def _asset(model: MjModel, mesh: int) -> Shape:
    """Return a mesh asset with one vertex per normal, so that edges between faces stay sharp."""
    first, n = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
    corners = np.stack([model.mesh_face[first : first + n], model.mesh_facenormal[first : first + n]], axis=2)
    pairs, faces = np.unique(corners.reshape(-1, 2), axis=0, return_inverse=True)
    return model.mesh_vert[model.mesh_vertadr[mesh] + pairs[:, 0]], faces.reshape(-1, 3)


def _box(half: Array) -> Shape:
    """Return a box whose faces have vertices of their own."""
    vertices = []
    for axis in range(3):
        for sign in (-1.0, 1.0):
            out, across = sign * np.eye(3)[axis], np.eye(3)[axis - 1]
            up = np.cross(out, across)
            corners = [out - across - up, out + across - up, out + across + up, out - across + up]
            vertices.append(np.array(corners) * half)
    faces = np.add.outer(4 * np.arange(6), np.array([[0, 1, 2], [0, 2, 3]]))
    return np.concatenate(vertices), faces.reshape(-1, 3)
