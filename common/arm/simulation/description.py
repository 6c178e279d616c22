"""Description of the scene for drawing, read from the compiled model."""

from __future__ import annotations

import re
from functools import cache

import numpy as np
from numpy.typing import NDArray

from farhand.common.arm import arm
from farhand.common.arm.cell import HIDDEN, Cell
from farhand.common.arm.engine import MjData, MjModel, mujoco
from farhand.common.arm.kinematics import compose, inverse, rotation
from farhand.common.arm.simulation import receptacle
from farhand.common.arm.simulation.scene import DECK, compile_scene
from farhand.common.arm.simulation.shapes import Shape, shape_of
from farhand.common.wire.packed import pack
from farhand.common.wire.scene_description import ArmLink, Colour, Mesh, SceneDescription

Array = NDArray[np.float64]

MOST_BYTES = 300_000
"""Budget of a description: an acoustic modem takes minutes for more [B]."""
_HULLS = (400, 200, 100, 50, 25, 12)
"""Numbers of corners to which meshes are reduced, one after the other, until the budget holds."""
MOST_SKETCH_BYTES = 8_000
"""Budget of a sketch, packed: an acoustic modem takes half a minute for it [B]."""
_SKETCH_HULLS = (50, 25, 12, 8, 6)


@cache
def describe(cell: Cell) -> SceneDescription:
    """Describe the looks of a scene within the budget: where a mesh has too much detail, its convex hull is drawn.

    Raises:
        InvalidConfiguration: When even coarse hulls are too much.
    """
    model = compile_scene(cell)
    size = 0
    for most_corners in (None, *_HULLS):
        described = _SceneReader(model, most_corners).read(cell)
        if (size := len(described.content)) <= MOST_BYTES:
            return described
    expected = (
        f"at most {MOST_BYTES // 1000} kB, by fewer groups or geoms; got {size // 1000} kB with coarse hulls"
    )
    raise cell.robot.invalid("looks", expected)


@cache
def sketch(cell: Cell) -> SceneDescription:
    """Describe the looks of a scene coarsely, as the first look over a slow link: by convex hulls within the budget.

    A scene of too many geoms gives the coarsest hulls.
    """
    model = compile_scene(cell)
    described = _SceneReader(model, _SKETCH_HULLS[0]).read(cell)
    for most_corners in _SKETCH_HULLS[1:]:
        if len(pack(described.content)) <= MOST_SKETCH_BYTES:
            break
        described = _SceneReader(model, most_corners).read(cell)
    return described


class _SceneReader:
    """Reader of a compiled model at rest, its joints at zero.

    Args:
        model: Model of the scene.
        most_corners: Largest number of corners of a mesh of the arm; None for all.
    """

    def __init__(self, model: MjModel, most_corners: int | None):
        self._most_corners = most_corners
        self._model, self._data = model, mujoco.MjData(model)
        mujoco.mj_kinematics(model, self._data)

    def read(self, cell: Cell) -> SceneDescription:
        model, data = self._model, self._data
        bodies = [
            0,
            *(int(model.jnt_bodyid[model.joint(name).id]) for name in arm.joint_names(cell.robot)),
        ]
        poses = [_pose(data.xpos[body], data.xquat[body]) for body in bodies]
        plug = model.body(arm.HELD).id
        of_arm = [b for b in range(model.nbody) if model.body(b).name.startswith(arm.ARM)]
        links = []
        for index, body in enumerate(bodies):
            parent = poses[max(index - 1, 0)]
            joint = model.body_jntadr[body]
            links.append(
                ArmLink(
                    _name(model.body(body).name),
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
            home_rad=tuple(cell.robot.home_rad),
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
            vertices, faces = shape_of(model, geom, self._most_corners)
            turn = data.geom_xmat[geom].reshape(3, 3)
            seen = (data.geom_xpos[geom] + vertices @ turn.T - origin[:3]) @ rotation(origin)
            parts.setdefault(_colour(model, geom), []).append((seen, faces))
        return tuple(Mesh.of(colour, *_joined(shapes)) for colour, shapes in parts.items())


def _name(body: str) -> str:
    """Return the name of a link as a description may have it."""
    return re.sub(r"[^A-Za-z0-9._-]", "-", body.rpartition("/")[2])[:32].lstrip("._-") or "link"


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
