"""Learned components as ellipses of two standard deviations, below a frame that carries them along."""

from __future__ import annotations

import numpy as np
import viser

from farhand.common.model.tphsmm import TPHSMM
from farhand.local_site.view.scene import palette, shapes
from farhand.local_site.view.scene.nodes import MODEL_Z_M, add_lines

_DEVIATIONS = 2.0
_OPACITY = 0.35
_ABOVE_M, _LAYERS = 1e-4, 20
"""Each component lies a little higher than the one before, for those that overlap [m]."""


class ModelDrawing:
    """Components of one model in the coordinates of a node: its first task frame.

    Args:
        scene: Scene of the server.
        parent: Name of the node that is the task frame.
    """

    def __init__(self, scene: viser.SceneApi, parent: str):
        self._scene, self._name = scene, f"{parent}/model"
        self._model: TPHSMM | None = None
        self._active = -1
        self._drawn: tuple[viser.BatchedMeshHandle, viser.LineSegmentsHandle] | None = None
        self._rims = np.zeros((0, 0, 2, 3))
        self._marked: viser.LineSegmentsHandle | None = None

    def show(self, model: TPHSMM | None, active: int = -1) -> None:
        """Show a model, or none, with the component in execution, or -1."""
        if model is self._model and active == self._active:
            return
        if model is None:
            self._remove()
            self._rims = self._rims[:0]
        elif model is not self._model:
            self._redraw(model)
        self._model, self._active = model, active
        self._mark(active)

    def _redraw(self, model: TPHSMM) -> None:
        """Change the drawing in place while the number of components stays: a new node would flicker."""
        values, vectors = np.linalg.eigh(model.covariances[0, :, :2, :2])
        radii = _DEVIATIONS * np.sqrt(values)
        heights = MODEL_Z_M + _ABOVE_M * (np.arange(model.n_components) % _LAYERS)
        positions = np.column_stack([model.means[0, :, :2], heights]).astype(np.float32)
        colours = palette.many([palette.component_colour(float(p)) for p in model.phase])
        angles = 0.5 * np.arctan2(vectors[:, 1, 1], vectors[:, 0, 1])  # half the length of the longer axis
        turns = np.column_stack([np.cos(angles), *np.zeros((2, angles.size)), np.sin(angles)])
        scales = np.column_stack([radii[:, 1], radii[:, 0], np.ones(angles.size)])
        rims = (shapes.circle() * radii[:, None, :]) @ np.swapaxes(vectors, 1, 2)
        points = np.dstack([rims, np.zeros(rims.shape[:2])]) + positions[:, None, :]
        self._rims = np.stack([points[:, :-1], points[:, 1:]], axis=2)
        lines = self._rims.reshape(-1, 2, 3).astype(np.float32)
        each = np.broadcast_to(colours[:, None, None, :], self._rims.shape).reshape(-1, 2, 3)
        if self._drawn is not None and len(self._drawn[0].batched_positions) == model.n_components:
            areas, outlines = self._drawn
            areas.batched_positions, areas.batched_wxyzs = positions, turns.astype(np.float32)
            areas.batched_scales, areas.batched_colors = scales.astype(np.float32), colours
            outlines.points, outlines.colors = lines, each
            return
        self._remove()
        areas = self._scene.add_batched_meshes_simple(
            f"{self._name}/areas", *shapes.disc(), turns, positions, batched_scales=scales, batched_colors=colours,
            opacity=_OPACITY, lod="off", flat_shading=True, side="double", cast_shadow=False, receive_shadow=False,
        )  # fmt: skip
        self._drawn = areas, add_lines(self._scene, f"{self._name}/outlines", lines, each, 1.5)

    def _remove(self) -> None:
        for node in self._drawn or ():
            node.remove()
        self._drawn = None

    def _mark(self, active: int) -> None:
        """Draw a white rim around the component in execution."""
        if self._marked is not None:
            self._marked.remove()
            self._marked = None
        if 0 <= active < len(self._rims):
            lines = self._rims[active] + [0.0, 0.0, _ABOVE_M]
            self._marked = add_lines(self._scene, f"{self._name}/active", lines, palette.ACTIVE, 4.0)
