"""Tube of two standard deviations around a path: how closely the demonstrations agree on each part of the way."""

from __future__ import annotations

import numpy as np
import viser
from numpy.typing import NDArray

from farhand.common.model.tphsmm import TPHSMM
from farhand.local_site.view.scene import palette, shapes
from farhand.local_site.view.scene.curves import in_space, thinned
from farhand.local_site.view.scene.nodes import NO_SHADOW

Array = NDArray[np.float64]

_DEVIATIONS, _OPACITY = 2.0, 0.18
_AROUND = 12
_SHARPEST = 1e-12
"""Least length of a step of a path whose direction is used [m]."""


class Tube:
    """Tube below a node that is the task frame; a band where the path is in a plane. Used by the page's thread.

    Args:
        scene: Scene of the server.
        parent: Name of the node.
        above_m: Height over the plane of a board [m].
    """

    def __init__(self, scene: viser.SceneApi, parent: str, above_m: float = 0.0):
        self._scene, self._name, self._above_m = scene, f"{parent}/tube", above_m
        self._node: viser.MeshHandle | None = None
        self._plan_id: int | None = None

    def show(self, points: Array | None, model: TPHSMM | None, plan_id: int) -> None:
        """Show the tube of a path, or none; it stays as it is while the path is executed.

        Args:
            points: Positions [m] or poses in the task frame. Shape (n, C); None for no path.
            model: Model that the path follows; None while unknown.
            plan_id: Id of the preview; 0 during an execution.
        """
        if points is None or model is None or len(points) < 2:
            self._remove()
        elif self._plan_id is None or plan_id not in (0, self._plan_id):
            self._remove()
            self._plan_id = plan_id
            vertices, faces = tube(thinned(points), model, self._above_m)
            self._node = self._scene.add_mesh_simple(
                self._name, vertices, faces, color=palette.PREDICTED, opacity=_OPACITY, side="double",
                flat_shading=True, **NO_SHADOW,
            )  # fmt: skip

    def _remove(self) -> None:
        self._plan_id = None
        if self._node is not None:
            self._node.remove()
            self._node = None


def tube(points: Array, model: TPHSMM, above_m: float = 0.0) -> shapes.Mesh:
    """Return the tube around a path as a mesh; around a path in a plane a band, at a height [m]."""
    n_dims = min(points.shape[1], 3)
    path = points[:, :n_dims]
    covariances = covariances_along(path, model)
    across = _across(path)
    angles = np.linspace(0.0, 2.0 * np.pi, _AROUND if n_dims == 3 else 2, endpoint=False)
    ways = np.cos(angles)[:, None, None] * across[0]
    if n_dims == 3:
        ways = ways + np.sin(angles)[:, None, None] * across[1]
    # The radius in a direction u is that of the ellipse that the covariance casts onto the plane across the path.
    radii = _DEVIATIONS * np.sqrt(np.einsum("atd,tde,ate->at", ways, covariances, ways))
    rings = path + radii[..., None] * ways
    flat = [in_space(ring, above_m) for ring in rings]
    vertices = np.stack(flat, axis=1).reshape(-1, 3)
    return vertices.astype(np.float32), _faces(len(path), len(angles), closed=n_dims == 3)


def covariances_along(path: Array, model: TPHSMM) -> Array:
    """Return the covariance at each point of a path, blended from the components by how likely each is there.

    Args:
        path: Positions in the last task frame [m]. Shape (n, D).
        model: Model that the path follows.

    Returns:
        Shape (n, D, D) [m^2].
    """
    n_dims = path.shape[1]
    covariances = model.covariances[-1, :, :n_dims, :n_dims]
    apart = path[:, None] - model.means[-1, :, :n_dims]
    distances = np.einsum("tki,kij,tkj->tk", apart, np.linalg.inv(covariances), apart)
    likelihood = -0.5 * (distances + np.linalg.slogdet(covariances)[1])
    weights = np.exp(likelihood - likelihood.max(axis=1, keepdims=True))
    weights /= weights.sum(axis=1, keepdims=True)
    return np.einsum("tk,kij->tij", weights, covariances)


def _across(path: Array) -> tuple[Array, Array]:
    """Return unit vectors across a path at each of its points, each of shape (n, D); in a plane only the first counts."""
    steps = np.gradient(path, axis=0)
    lengths = np.linalg.norm(steps, axis=1, keepdims=True)
    moves = np.flatnonzero(lengths[:, 0] > _SHARPEST)
    if not moves.size:
        return np.zeros_like(path), np.zeros_like(path)
    # Where the path rests it has the direction in which it came, or at first the one in which it goes.
    newest = moves[np.maximum(np.searchsorted(moves, np.arange(len(path)), side="right") - 1, 0)]
    along = steps[newest] / lengths[newest]
    if path.shape[1] == 2:
        first = np.column_stack([-along[:, 1], along[:, 0]])
        return first, first
    first = np.empty_like(path)
    last = np.eye(3)[np.argmin(np.abs(along[0]))]
    for k, tangent in enumerate(along):  # carried along the path, so that the tube is not twisted
        last = last - (last @ tangent) * tangent
        last /= max(float(np.linalg.norm(last)), _SHARPEST)
        first[k] = last
    return first, np.asarray(np.cross(along, first), dtype=float)


def _faces(n_points: int, n_around: int, closed: bool) -> NDArray[np.uint32]:
    """Return the triangles between the rings of a tube, or between the two edges of a band."""
    here = np.arange(n_points - 1)[:, None] * n_around + np.arange(n_around if closed else n_around - 1)
    beside = (here // n_around) * n_around + (here + 1) % n_around
    lower = np.stack([here, here + n_around, beside], axis=-1)
    upper = np.stack([beside, here + n_around, beside + n_around], axis=-1)
    return np.concatenate([lower, upper]).reshape(-1, 3).astype(np.uint32)
