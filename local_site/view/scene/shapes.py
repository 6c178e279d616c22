"""Meshes: flat ones in the plane of a board, looking up, and a sphere. Vertices (V, 3) [m], faces (F, 3)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Mesh = tuple[NDArray[np.float32], NDArray[np.uint32]]

U_WIDTH_M = 0.13
U_HEIGHT_M = 0.15
_U_THICKNESS_M = 0.02
_SEGMENTS = 40


def disc(radius_m: float = 1.0) -> Mesh:
    """Make a filled circle about the origin."""
    angles = np.linspace(0.0, 2.0 * np.pi, _SEGMENTS, endpoint=False)
    rim = np.stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)], axis=1) * radius_m
    index = np.arange(_SEGMENTS)
    faces = np.stack([np.full(_SEGMENTS, _SEGMENTS), index, (index + 1) % _SEGMENTS], axis=1)
    return np.vstack([rim, np.zeros(3)]).astype(np.float32), faces.astype(np.uint32)


def sphere() -> Mesh:
    """Make the unit sphere."""
    n_around, n_down = 24, 13
    around = np.linspace(0.0, 2.0 * np.pi, n_around, endpoint=False)
    down = np.linspace(0.0, np.pi, n_down)
    rings = np.sin(down)[:, None, None] * np.stack([np.cos(around), np.sin(around), 0.0 * around], axis=1)
    rings[:, :, 2] = np.cos(down)[:, None]
    here = np.arange(n_around) + n_around * np.arange(n_down - 1)[:, None]
    beside = np.roll(here, -1, axis=1)
    faces = np.concatenate(
        [
            np.stack([here, here + n_around, beside], -1),
            np.stack([beside, here + n_around, beside + n_around], -1),
        ]
    )
    return rings.reshape(-1, 3).astype(np.float32), faces.reshape(-1, 3).astype(np.uint32)


def circle() -> NDArray[np.float64]:
    """Make the unit circle as a closed polyline. Shape (T, 2)."""
    angles = np.linspace(0.0, 2.0 * np.pi, _SEGMENTS + 1)
    return np.column_stack([np.cos(angles), np.sin(angles)])


def ring(radius_m: float, inner_m: float) -> Mesh:
    """Make a circle with a hole about the origin."""
    outer, inner = disc(radius_m)[0][:-1], disc(inner_m)[0][:-1]
    a, b = np.arange(_SEGMENTS), (np.arange(_SEGMENTS) + 1) % _SEGMENTS
    faces = np.vstack([np.stack([a, b, a + _SEGMENTS], 1), np.stack([b, b + _SEGMENTS, a + _SEGMENTS], 1)])
    return np.vstack([outer, inner]).astype(np.float32), faces.astype(np.uint32)


def rectangle(x_m: float, y_m: float, width_m: float, height_m: float) -> Mesh:
    """Make a rectangle from its lower left corner and its size."""
    corners = [
        [x_m, y_m, 0],
        [x_m + width_m, y_m, 0],
        [x_m + width_m, y_m + height_m, 0],
        [x_m, y_m + height_m, 0],
    ]
    return np.array(corners, np.float32), np.array([[0, 1, 2], [0, 2, 3]], np.uint32)


def u_shape() -> Mesh:
    """Make the paper's U, open towards +y, centred at the origin."""
    w, h, t = U_WIDTH_M, U_HEIGHT_M, _U_THICKNESS_M
    return joined(
        rectangle(-0.5 * w, -0.5 * h, t, h),
        rectangle(0.5 * w - t, -0.5 * h, t, h),
        rectangle(-0.5 * w + t, -0.5 * h, w - 2.0 * t, t),
    )


def joined(*meshes: Mesh) -> Mesh:
    """Join several meshes into one."""
    offsets = np.cumsum([0] + [len(vertices) for vertices, _ in meshes])
    faces = [faces + np.uint32(offset) for (_, faces), offset in zip(meshes, offsets, strict=False)]
    return np.vstack([vertices for vertices, _ in meshes]), np.vstack(faces)


def segments(points: NDArray[np.float64], z_m: float) -> NDArray[np.float32]:
    """Split a polyline (T, >= 2), seen from above, into line segments (T - 1, 2, 3) at a height [m]."""
    raised = np.column_stack([points[:, :2], np.full(len(points), z_m)]).astype(np.float32)
    return np.stack([raised[:-1], raised[1:]], axis=1)
