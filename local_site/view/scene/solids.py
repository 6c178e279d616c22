"""Solid things of a scene: meshes with a colour below a node, sent only when something has changed."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import viser
from numpy.typing import NDArray

from farhand.common.model.manifold import POSE
from farhand.common.wire.scene_description import Mesh
from farhand.local_site.view.scene.palette import Rgb

Array = NDArray[np.float64]

Limits = tuple[float, float]

UNCHANGED: Limits = (5e-4, 2e-3)
"""What moved less than this has not moved: sending it would make the browser draw for nothing [m, rad]."""
SEEN_UNCHANGED: Limits = (2e-3, 2e-2)
"""The same of what is seen with noise: a pixel or so [m, rad]."""
NO_SHADOW: dict[str, Any] = {"cast_shadow": False, "receive_shadow": False}


def moved(before: Array, after: Array, limits: Limits = UNCHANGED) -> bool:
    """Whether any of some poses has moved. Shapes (..., 7)."""
    change = np.abs(POSE.log(before, after))
    return bool((change[..., :3] > limits[0]).any() or (change[..., 3:] > limits[1]).any())


def put(node: viser.SceneNodeHandle, pose: Array, limits: Limits = UNCHANGED) -> None:
    """Move a node to a pose, unless it is there already. Shape (7,)."""
    if moved(np.concatenate([node.position, node.wxyz]), pose, limits):
        node.position, node.wxyz = pose[:3], pose[3:]


def add_solids(
    scene: viser.SceneApi, name: str, meshes: Iterable[Mesh], colour: Rgb | None = None, **more: Any
) -> list[viser.MeshHandle]:
    """Meshes below a node, in their own colours or all in one."""
    return [
        scene.add_mesh_simple(
            f"{name}/{index}",
            mesh.vertices_m,
            mesh.triangles,
            color=colour or mesh.colour,
            **NO_SHADOW,
            **more,
        )
        for index, mesh in enumerate(meshes)
    ]
