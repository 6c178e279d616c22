"""Flat and solid parts of a scene, sent only when they have changed."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import viser
from numpy.typing import NDArray

from farhand.common.model.manifold import POSE
from farhand.common.wire.scene_description import Mesh
from farhand.local_site.view.scene import shapes
from farhand.local_site.view.scene.palette import Rgb

Array = NDArray[np.float64]

GRID_Z_M, MODEL_Z_M, LINE_Z_M, TARGET_Z_M, MARK_Z_M, MAT_Z_M = 0.001, 0.002, 0.005, 0.006, 0.008, 0.01
"""Heights that decide which drawing covers which; the mat over all of it, so that nothing hangs over the edge of a board [m]."""
HIDDEN_Z_M, ASIDE_Z_M = -0.05, -0.06
"""Height of the surfaces that take drags, under the boards: viser would draw an arrow and an outline on it [m]."""
_UNCHANGED_M = 5e-4
"""Least motion that is sent: a smaller one would make the browser draw for nothing."""


def add_flat(
    scene: viser.SceneApi, name: str, mesh: shapes.Mesh, colour: Rgb, z_m: float, **more: Any
) -> viser.MeshHandle:
    """Add a flat mesh without shadows."""
    return scene.add_mesh_simple(
        name, *mesh, color=colour, flat_shading=True, side="double", cast_shadow=False,
        receive_shadow=False, position=(0.0, 0.0, z_m), **more,
    )  # fmt: skip


def add_lines(
    scene: viser.SceneApi, name: str, points: np.ndarray, colour: Rgb | np.ndarray, width_px: float
) -> viser.LineSegmentsHandle:
    """Add lines of a fixed thickness on the screen; the same name again replaces them.

    Args:
        scene: Scene of the server.
        name: Name of the node.
        points: Shape (N, 2, 3) [m].
        colour: One colour, or one per end of each line, shape (N, 2, 3).
        width_px: Thickness.
    """
    return scene.add_line_segments(
        name, points.astype(np.float32), colour, thickness=width_px, thickness_units="screen"
    )  # fmt: skip


def place(node: viser.SceneNodeHandle, x: float, y: float, z: float) -> None:
    """Move a node, unless it is there already."""
    now = node.position
    if abs(now[0] - x) + abs(now[1] - y) > _UNCHANGED_M:
        node.position = (x, y, z)


def show(node: viser.SceneNodeHandle, visible: bool) -> None:
    """Show or hide a node, unless it is so already."""
    if node.visible != visible:
        node.visible = visible


Limits = tuple[float, float]

UNCHANGED: Limits = (5e-4, 2e-3)
"""Least motion that is sent: a smaller one would make the browser draw for nothing [m, rad]."""
SEEN_UNCHANGED: Limits = (2e-3, 2e-2)
"""The same of what is seen with noise: a pixel or so [m, rad]."""
NO_SHADOW: dict[str, Any] = {"cast_shadow": False, "receive_shadow": False}


class Layers:
    """Parts of a scene, and single demonstrations, that the operator hides and shows by name. Used by the page's thread.

    Args:
        scene: Scene of the server.
        colours: Colour of each layer by its name.
    """

    def __init__(self, scene: viser.SceneApi, colours: dict[str, Rgb]):
        self._scene, self.colours = scene, colours
        self._hidden: set[str] = set()
        self.hidden_demonstrations: frozenset[str] = frozenset()
        """Names of the demonstrations that are not drawn; they stay learned."""
        self._nodes: dict[str, dict[str, viser.FrameHandle]] = {name: {} for name in colours}

    def node(self, layer: str, name: str) -> str:
        """Add a node of a layer, or replace it; return its name, below which the layer's parts are drawn."""
        visible = layer not in self._hidden
        self._nodes[layer][name] = self._scene.add_frame(name, show_axes=False, visible=visible)
        return name

    def shown(self, layer: str) -> bool:
        """Return whether a layer is shown."""
        return layer not in self._hidden

    def toggle(self, layer: str) -> None:
        """Hide a layer, or show it again."""
        self._hidden ^= {layer}
        for node in self._nodes[layer].values():
            show(node, self.shown(layer))

    def toggle_demonstration(self, name: str) -> None:
        """Hide a single demonstration, or draw it again."""
        self.hidden_demonstrations ^= {name}


def moved(before: Array, after: Array, limits: Limits = UNCHANGED) -> bool:
    """Decide whether any of some poses has moved. Shapes (..., 7)."""
    change = np.abs(POSE.log(before, after))
    return bool((change[..., :3] > limits[0]).any() or (change[..., 3:] > limits[1]).any())


def put(node: viser.SceneNodeHandle, pose: Array, limits: Limits = UNCHANGED) -> None:
    """Move a node to a pose, unless it is there already. Shape (7,)."""
    if moved(np.concatenate([node.position, node.wxyz]), pose, limits):
        node.position, node.wxyz = pose[:3], pose[3:]


def add_solids(
    scene: viser.SceneApi, name: str, meshes: Iterable[Mesh], colour: Rgb | None = None, **more: Any
) -> list[viser.MeshHandle]:
    """Add meshes below a node, in their own colours or all in one."""
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
