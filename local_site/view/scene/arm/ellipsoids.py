"""Learned components as ellipsoids of two standard deviations, below a node that is the task frame."""

from __future__ import annotations

import numpy as np
import viser
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from farhand.common.model.tphsmm import TPHSMM
from farhand.local_site.view.scene import palette, shapes
from farhand.local_site.view.scene.nodes import NO_SHADOW

Array = NDArray[np.float64]

_DEVIATIONS = 2.0
_OPACITY, _ACTIVE_OPACITY = 0.42, 0.85


class Ellipsoids:
    """Components of one model in the coordinates of a node: its last task frame.

    Args:
        scene: Scene of the server.
        parent: Name of the node.
    """

    def __init__(self, scene: viser.SceneApi, parent: str):
        self._scene, self._name = scene, f"{parent}/components"
        self._model: TPHSMM | None = None
        self._active = -1
        self._batch: viser.BatchedMeshHandle | None = None

    def show(self, model: TPHSMM | None, active: int = -1) -> None:
        """Show a model, or none, with the component in execution, or -1."""
        if model is not self._model:
            self._model, self._active = model, active
            self._redraw(model, active)
        elif active != self._active:
            self._active = active
            if self._batch is not None and model is not None:
                self._batch.batched_opacities = _opacities(model, active)

    def _redraw(self, model: TPHSMM | None, active: int) -> None:
        """Change the drawing in place while the number of components stays: a new node would flicker."""
        if model is None:
            if self._batch is not None:
                self._batch.remove()
                self._batch = None
            return
        places = model.means[-1, :, :3].astype(np.float32)
        scales, turns = axes_of(model.covariances[-1, :, :3, :3])
        colours = palette.many([palette.component_colour(float(phase)) for phase in model.phase])
        if self._batch is not None and len(self._batch.batched_positions) == model.n_components:
            batch = self._batch
            batch.batched_positions, batch.batched_wxyzs = places, turns
            batch.batched_scales, batch.batched_colors = scales, colours
            batch.batched_opacities = _opacities(model, active)
            return
        self._batch = self._scene.add_batched_meshes_simple(
            self._name, *shapes.sphere(), turns, places, batched_scales=scales, batched_colors=colours,
            batched_opacities=_opacities(model, active), opacity=1.0, lod="off", **NO_SHADOW,
        )  # fmt: skip


def _opacities(model: TPHSMM, active: int) -> NDArray[np.float32]:
    return np.where(np.arange(model.n_components) == active, _ACTIVE_OPACITY, _OPACITY).astype(np.float32)


def axes_of(covariances: Array) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return half axes (K, 3) [m] and orientations (K, 4) of covariances' ellipsoids (K, 3, 3) [m^2]."""
    values, vectors = np.linalg.eigh(covariances)
    vectors[:, :, 0] *= np.linalg.det(vectors)[:, None]  # no mirror images
    turns = Rotation.from_matrix(vectors).as_quat(scalar_first=True)
    return (_DEVIATIONS * np.sqrt(values)).astype(np.float32), turns.astype(np.float32)
