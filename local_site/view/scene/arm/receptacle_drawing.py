"""Drawing of a receptacle with its panel: a node that is the task frame and carries its contents."""

from __future__ import annotations

import numpy as np
import viser
from numpy.typing import NDArray

from farhand.common.wire.scene_description import SceneDescription
from farhand.local_site.view.scene import palette
from farhand.local_site.view.scene.nodes import SEEN_UNCHANGED, add_solids, put
from farhand.local_site.view.scene.palette import Rgb

Array = NDArray[np.float64]

_STEEL: Rgb = (92, 108, 120)
_PALE, _PLATFORM = 0.78, 0.25
"""How much of steel's colour is in what only stands around: the arms are what matters."""


class ReceptacleDrawing:
    """Drawing of one receptacle. Used by the page's thread.

    Args:
        scene: Scene of the server.
        parent: Name of the node of the arm's base.
        description: Description of the receptacle.
    """

    def __init__(self, scene: viser.SceneApi, parent: str, description: SceneDescription):
        self.name = f"{parent}/receptacle"
        self._node = scene.add_frame(self.name, show_axes=False, visible=False)
        self._meshes = add_solids(scene, self.name, description.receptacle)
        self._colours = [palette.mixed(mesh.colour, _STEEL, _PALE) for mesh in description.receptacle]
        self._paint(old=False)
        self._old = False

    def draw(self, pose: Array, old: bool = False) -> None:
        """Show it where it was seen, grey when that is long ago. Shape (7,)."""
        put(self._node, pose, SEEN_UNCHANGED)
        if not self._node.visible:
            self._node.visible = True
        if old != self._old:
            self._old = old
            self._paint(old)

    def _paint(self, old: bool) -> None:
        for mesh, colour in zip(self._meshes, self._colours, strict=True):
            mesh.color = palette.mixed(colour, palette.OLD, 0.75) if old else colour


def add_platform(scene: viser.SceneApi, parent: str, description: SceneDescription) -> None:
    """Add the platform that the arm stands on."""
    meshes = add_solids(scene, f"{parent}/platform", description.platform)
    for mesh, drawn in zip(description.platform, meshes, strict=True):
        drawn.color = palette.mixed(mesh.colour, _STEEL, _PLATFORM)
