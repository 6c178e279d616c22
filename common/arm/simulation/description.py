"""Description of the scene for drawing, read from the compiled model."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from farhand.common.arm import arm
from farhand.common.arm.dimensions import HIDDEN, Dimensions
from farhand.common.arm.engine import MjData, MjModel, mujoco
from farhand.common.arm.kinematics import compose, inverse, rotation
from farhand.common.arm.lathe import turned
from farhand.common.arm.simulation import receptacle
from farhand.common.arm.simulation.scene import DECK, compile_scene
from farhand.common.wire.scene_description import ArmLink, Colour, Mesh, SceneDescription

Array = NDArray[np.float64]
Shape = tuple[Array, NDArray[np.int64]]
"""Vertices (V, 3) [m] and triangles of them (F, 3)."""

_ARM = arm.JOINTS[0].partition("/")[0]
_ROUND = 20
"""Number of flat faces around a cylinder."""


@cache
def describe(dimensions: Dimensions) -> SceneDescription:
    """Describe the looks of a scene with these dimensions."""
    return _SceneReader(compile_scene(dimensions)).read(dimensions)


class _SceneReader:
    """Reader of a compiled model at rest, its joints at zero."""

    def __init__(self, model: MjModel):
        self._model, self._data = model, mujoco.MjData(model)
        mujoco.mj_kinematics(model, self._data)

    def read(self, dimensions: Dimensions) -> SceneDescription:
        model, data = self._model, self._data
        bodies = [0, *(int(model.jnt_bodyid[model.joint(name).id]) for name in arm.JOINTS)]
        poses = [_pose(data.xpos[body], data.xquat[body]) for body in bodies]
        plug = model.body(arm.HELD).id
        of_arm = [b for b in range(model.nbody) if model.body(b).name.startswith(f"{_ARM}/") and b != plug]
        links = []
        for index, body in enumerate(bodies):
            parent = poses[max(index - 1, 0)]
            joint = model.body_jntadr[body]
            links.append(
                ArmLink(
                    model.body(body).name.rpartition("/")[2],
                    index - 1,
                    _tuple(compose(inverse(parent), poses[index])),
                    tuple(model.jnt_axis[joint].tolist()) if index else (0.0, 0.0, 0.0),
                    self._meshes(poses[index], [b for b in of_arm if model.body_weldid[b] == body]),
                )
            )
        mouth, tip = (_site(data, name) for name in (receptacle.MOUTH, arm.TIP))
        holder = int(model.site_bodyid[model.site(receptacle.MOUTH).id])
        deck = [model.geom(name).id for name in DECK]
        return SceneDescription(
            links=tuple(links),
            tip=_tuple(compose(inverse(poses[-1]), tip)),
            held=self._meshes(poses[-1], [plug]),
            home_rad=tuple(dimensions.home_rad),
            receptacle=self._meshes(mouth, [holder]),
            platform=self._drawn(poses[0], deck),
        )

    def _meshes(self, origin: Array, bodies: list[int]) -> tuple[Mesh, ...]:
        """Collect the visible meshes of some bodies, seen from a pose."""
        model = self._model
        shown = np.isin(model.geom_bodyid, bodies) & (model.geom_group != HIDDEN)
        return self._drawn(origin, np.flatnonzero(shown).tolist())

    def _drawn(self, origin: Array, geoms: list[int]) -> tuple[Mesh, ...]:
        """Collect some geoms seen from a pose: one mesh for each colour."""
        model, data = self._model, self._data
        parts: dict[Colour, list[Shape]] = {}
        for geom in geoms:
            vertices, faces = _shape(model, geom)
            turn = data.geom_xmat[geom].reshape(3, 3)
            seen = (data.geom_xpos[geom] + vertices @ turn.T - origin[:3]) @ rotation(origin)
            parts.setdefault(_colour(model, geom), []).append((seen, faces))
        return tuple(Mesh.of(colour, *_joined(shapes)) for colour, shapes in parts.items())


def _shape(model: MjModel, geom: int) -> Shape:
    """Return the shape of a geom in the geom's own axes."""
    r, half, _ = size = model.geom_size[geom]
    kind = mujoco.mjtGeom(int(model.geom_type[geom]))
    match kind.name:
        case "mjGEOM_MESH":
            return _asset(model, int(model.geom_dataid[geom]))
        case "mjGEOM_BOX":
            return _box(size)
        case "mjGEOM_CYLINDER":
            vertices, _, faces = turned([(0.0, -half), (r, -half), (r, half), (0.0, half)], _ROUND)
            return vertices, faces
        case _:
            raise NotImplementedError(f"{kind.name} is not drawn")


def _asset(model: MjModel, mesh: int) -> Shape:
    """Return a mesh asset with one vertex per normal, so that edges between faces stay sharp."""
    first, n = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
    corners = np.stack([model.mesh_face[first : first + n], model.mesh_facenormal[first : first + n]], axis=2)
    pairs, faces = np.unique(corners.reshape(-1, 2), axis=0, return_inverse=True)
    return model.mesh_vert[model.mesh_vertadr[mesh] + pairs[:, 0]], faces.reshape(-1, 3)


def _box(half: Array) -> Shape:
    """Return a box whose faces have vertices of their own."""
    vertices = []
    for axis in range(3):
        for sign in (-1.0, 1.0):
            out, across = sign * np.eye(3)[axis], np.eye(3)[axis - 1]
            up = np.cross(out, across)
            corners = [out - across - up, out + across - up, out + across + up, out - across + up]
            vertices.append(np.array(corners) * half)
    faces = np.add.outer(4 * np.arange(6), np.array([[0, 1, 2], [0, 2, 3]]))
    return np.concatenate(vertices), faces.reshape(-1, 3)


def _joined(shapes: list[Shape]) -> Shape:
    offsets = np.cumsum([0, *(len(vertices) for vertices, _ in shapes)])
    faces = [faces + offset for (_, faces), offset in zip(shapes, offsets, strict=False)]
    return np.concatenate([vertices for vertices, _ in shapes]), np.concatenate(faces)


def _colour(model: MjModel, geom: int) -> Colour:
    material = model.geom_matid[geom]
    red, green, blue = (model.mat_rgba[material] if material >= 0 else model.geom_rgba[geom])[:3]
    return round(255 * float(red)), round(255 * float(green)), round(255 * float(blue))


def _site(data: MjData, name: str) -> Array:
    site, quat = data.site(name), np.empty(4)
    mujoco.mju_mat2Quat(quat, site.xmat)
    return _pose(site.xpos, quat)


def _pose(position: Array, quat_wxyz: Array) -> Array:
    return np.concatenate([position, quat_wxyz])


def _tuple(pose: Array) -> tuple[float, float, float, float, float, float, float]:
    x, y, z, qw, qx, qy, qz = pose.tolist()
    return x, y, z, qw, qx, qy, qz
