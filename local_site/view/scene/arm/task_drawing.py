"""Drawings in a task frame: the receptacle, learned components as ellipsoids, and demonstrations."""

from __future__ import annotations

import numpy as np
import viser
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from farhand.common.model.tphsmm import TPHSMM
from farhand.common.wire.scene_description import SceneDescription
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.view.scene import palette, shapes
from farhand.local_site.view.scene.curves import Curves, thinned
from farhand.local_site.view.scene.nodes import NO_SHADOW, SEEN_UNCHANGED, Layers, add_solids, put
from farhand.local_site.view.scene.palette import Rgb

Array = NDArray[np.float64]

_STEEL: Rgb = (92, 108, 120)
_PALE, _PLATFORM = 0.78, 0.25
"""Share of steel's colour in fixed objects, so that the arms stand out."""


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
        """Draw the receptacle at its reported pose, grey if the report is old. Shape (7,)."""
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


class Demonstrations:
    """Curves of the demonstrations, in the coordinates of a node that is the task frame.

    Args:
        scene: Scene of the server.
        parent: Name of the node.
        layers: What the operator hides and shows.
    """

    def __init__(self, scene: viser.SceneApi, parent: str, layers: Layers):
        self._layers = layers
        self._ended = Curves(scene, f"{parent}/demonstrations", 3.5)
        self._current = Curves(scene, f"{parent}/demonstration", 4.0)
        self._shown: tuple[object, ...] = ()

    def draw(self, state: ConsoleState) -> None:
        """Draw the ended demonstrations in the components' colours, and the one in progress in white."""
        model = state.learned.model if state.learned else None
        hidden = [name in self._layers.hidden_demonstrations for name in state.demonstration_names]
        shown = (model, *map(len, state.strokes), *hidden)
        if shown == self._shown:
            return
        self._shown = shown
        curves = [
            thinned(frames[-1].to_local(stroke[:, :3]))
            for stroke, frames in zip(state.strokes, state.stroke_frames, strict=True)
        ]
        ended = [curve for curve, away in zip(curves, hidden, strict=False) if not away]
        current = curves[state.n_demonstrations :]
        self._current.show(current, [palette.many([palette.CURRENT_STROKE])] * len(current))
        self._ended.show(ended, [_by_component(curve, model) for curve in ended])


def _by_component(curve: Array, model: TPHSMM | None) -> NDArray[np.uint8]:
    """Colour each point of a curve by its most likely component."""
    if model is None:
        return palette.many([palette.STROKE])
    covariances = model.covariances[-1, :, :3, :3]
    apart = curve[:, None] - model.means[-1, :, :3]
    distance = np.einsum("tki,kij,tkj->tk", apart, np.linalg.inv(covariances), apart)
    nearest = np.argmin(distance + np.linalg.slogdet(covariances)[1], axis=1)
    return palette.many([palette.component_colour(float(phase)) for phase in model.phase])[nearest]
