"""The learned components as ellipses of two standard deviations, below a frame that carries them along."""

from __future__ import annotations

import numpy as np
import viser

from common.tphsmm import TPHSMM
from local_site.view import palette, shapes
from local_site.view.flat import MODEL_Z_M, add_lines

_DEVIATIONS = 2.0
_OPACITY, _ACTIVE_OPACITY = 0.35, 0.8
_ABOVE_M, _LAYERS = 1e-4, 20
"""Each component lies a little higher than the one before, for those that overlap [m]."""


class ModelDrawing:
    """The components of one model in the coordinates of a node: its first task frame.

    Args:
        scene: Of the server.
        parent: Name of the node that is the task frame.
    """

    def __init__(self, scene: viser.SceneApi, parent: str):
        self._scene, self._name = scene, f"{parent}/model"
        self._model: TPHSMM | None = None
        self._active = -1
        self._ellipses: viser.BatchedMeshHandle | None = None
        self._outlines: viser.LineSegmentsHandle | None = None

    def show(self, model: TPHSMM | None, active: int = -1) -> None:
        """Show a model, or none, with the component that is being executed, or -1."""
        if model is not self._model:
            self._model, self._active = model, active
            self._replace()
        elif active != self._active and self._ellipses is not None and model is not None:
            self._active = active
            self._ellipses.batched_opacities = self._opacities(model)

    def _replace(self) -> None:
        for drawn in (self._ellipses, self._outlines):
            if drawn is not None:
                drawn.remove()
        self._ellipses = self._outlines = None
        model = self._model
        if model is None:
            return
        values, vectors = np.linalg.eigh(model.covariances[0, :, :2, :2])
        radii = _DEVIATIONS * np.sqrt(values)
        heights = MODEL_Z_M + _ABOVE_M * (np.arange(model.n_components) % _LAYERS)
        positions = np.column_stack([model.means[0, :, :2], heights])
        colours = palette.many([palette.component_colour(float(p)) for p in model.phase])
        angles = 0.5 * np.arctan2(vectors[:, 1, 1], vectors[:, 0, 1])  # of the longer axis, halved
        turns = np.column_stack([np.cos(angles), *np.zeros((2, angles.size)), np.sin(angles)])
        self._ellipses = self._scene.add_batched_meshes_simple(
            f"{self._name}/areas", *shapes.disc(), turns, positions,
            batched_scales=np.column_stack([radii[:, 1], radii[:, 0], np.ones(angles.size)]),
            batched_colors=colours, batched_opacities=self._opacities(model), lod="off", flat_shading=True,
            side="double", cast_shadow=False, receive_shadow=False,
        )  # fmt: skip
        rims = (shapes.circle() * radii[:, None, :]) @ np.swapaxes(vectors, 1, 2)
        points = np.dstack([rims, np.zeros(rims.shape[:2])]) + positions[:, None, :]
        lines = np.stack([points[:, :-1], points[:, 1:]], axis=2)
        each = np.broadcast_to(colours[:, None, None, :], lines.shape)
        self._outlines = add_lines(
            self._scene, f"{self._name}/outlines", lines.reshape(-1, 2, 3), each.reshape(-1, 2, 3), 1.5
        )

    def _opacities(self, model: TPHSMM) -> np.ndarray:
        opacities = np.full(model.n_components, _OPACITY, np.float32)
        if 0 <= self._active < model.n_components:
            opacities[self._active] = _ACTIVE_OPACITY
        return opacities
