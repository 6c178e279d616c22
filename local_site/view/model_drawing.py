"""The learned components as ellipses of two standard deviations, below a frame that carries them along."""

from __future__ import annotations

import numpy as np
import viser

from common.tphsmm import TPHSMM
from local_site.view import palette, shapes
from local_site.view.boards import MODEL_Z_M

_DEVIATIONS = 2.0
_OPACITY, _ACTIVE_OPACITY = 0.38, 0.9


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

    def show(self, model: TPHSMM | None, active: int = -1) -> None:
        """Show a model, or none, with the component that is being executed, or -1."""
        if model is not self._model:
            self._model, self._active = model, active
            self._replace()
        elif active != self._active and self._ellipses is not None and model is not None:
            self._active = active
            self._ellipses.batched_opacities = self._opacities(model)

    def _replace(self) -> None:
        if self._ellipses is not None:
            self._ellipses.remove()
            self._ellipses = None
        model = self._model
        if model is None:
            return
        positions = np.column_stack([model.means[0, :, :2], np.full(model.n_components, MODEL_Z_M)])
        values, vectors = np.linalg.eigh(model.covariances[0, :, :2, :2])
        angles = 0.5 * np.arctan2(vectors[:, 1, 1], vectors[:, 0, 1])  # of the longer axis, halved
        turns = np.column_stack([np.cos(angles), *np.zeros((2, angles.size)), np.sin(angles)])
        radii = _DEVIATIONS * np.sqrt(values)
        scales = np.column_stack([radii[:, 1], radii[:, 0], np.ones(angles.size)])
        self._ellipses = self._scene.add_batched_meshes_simple(
            self._name, *shapes.disc(), turns, positions, batched_scales=scales,
            batched_colors=np.array([palette.component_colour(p) for p in model.phase], np.uint8),
            batched_opacities=self._opacities(model), lod="off", flat_shading=True, side="double",
            cast_shadow=False, receive_shadow=False,
        )  # fmt: skip

    def _opacities(self, model: TPHSMM) -> np.ndarray:
        opacities = np.full(model.n_components, _OPACITY, np.float32)
        if 0 <= self._active < model.n_components:
            opacities[self._active] = _ACTIVE_OPACITY
        return opacities
