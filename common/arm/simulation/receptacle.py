"""Receptacle and its panel: MJCF.

Contacts see a ring of boxes around the bore, another for the chamfer, and a thick bottom: primitives, which
MuJoCo handles exactly. The body has six joints, each with a servo that pulls it to its place, so that it
yields like a panel on a frame, and moves with a velocity that the contacts feel.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from farhand.common.arm.cell import HIDDEN, LINK, PLUG, UNTOUCHABLE, Cell, Receptacle
from farhand.common.arm.engine import mjcf
from farhand.common.arm.kinematics import rotation
from farhand.common.arm.revolved_mesh import add_revolved_mesh

Array = NDArray[np.float64]

MOUTH = "receptacle/mouth"
JOINTS = tuple(f"receptacle/{name}" for name in ("x", "y", "z", "rx", "ry", "rz"))

FACING = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
"""Orientation of a receptacle that faces the arm, in the axes of the base; the joints rotate it further."""
FACING_QUAT = np.array([0.5, -0.5, 0.5, -0.5])

_SIDES = 16


def make_receptacle(cell: Cell) -> Any:
    """Build the receptacle on its spring and return its MJCF root, to be attached at the arm's base."""
    root = mjcf.RootElement(model="receptacle")
    root.compiler.angle = "radian"
    body = root.worldbody.add("body", name="receptacle", quat=FACING_QUAT, gravcomp=1)
    _add_spring(root, body, cell.receptacle)
    touching = {
        "type": "box",
        "contype": PLUG,
        "conaffinity": PLUG,
        "condim": 3,
        "mass": 0,
        "group": HIDDEN,
        "friction": (cell.contact.friction, 0.005, 0.0001),
        "solref": cell.contact.solref,
        "solimp": cell.contact.solimp,
    }
    _add_bore(body, cell.receptacle, touching)
    _add_panel(body, cell.receptacle, {**touching, "conaffinity": PLUG | LINK})
    _add_looks(root, body, cell.receptacle)
    body.add("site", name="mouth", size=(0.001,), group=4)
    return root


def _add_spring(root: Any, body: Any, receptacle: Receptacle) -> None:
    m, i = receptacle.mass_kg, receptacle.inertia_kg_m2
    body.add("inertial", pos=(0, 0, 0), mass=m, diaginertia=(i, i, i))
    axes = np.vstack([FACING, np.eye(3)])  # slides along the base's axes: FACING^T e_k
    for name, axis in zip(("x", "y", "z", "rx", "ry", "rz"), axes, strict=True):
        slides = len(name) == 1
        joint = body.add("joint", name=name, type="slide" if slides else "hinge", axis=axis)
        k, inertia = (receptacle.stiffness_n_m, m) if slides else (receptacle.stiffness_nm_rad, i)
        damping = 2.0 * np.sqrt(k * inertia)  # critical damping
        root.actuator.add("position", name=name, joint=joint, kp=k, kv=damping)


def _add_bore(body: Any, receptacle: Receptacle, touching: dict[str, Any]) -> None:
    """Add the bore, a prism of boxes whose inner faces are tangent to it."""
    r, depth, chamfer = receptacle.bore_radius_m, receptacle.depth_m, receptacle.chamfer_m
    outer = receptacle.outer_radius_m
    half_width = outer * np.tan(np.pi / _SIDES)
    thickness = 0.5 * (outer - r)
    slope = chamfer / np.sqrt(2.0)  # half the length of the chamfer's face
    slab = 0.5 * (outer - r - chamfer) / np.sqrt(2.0)
    for angle in 2.0 * np.pi * np.arange(_SIDES) / _SIDES:
        out = np.array([np.cos(angle), np.sin(angle), 0.0])
        along = np.array([0.0, 0.0, 1.0])
        centre = (r + thickness) * out + 0.5 * (chamfer + depth) * along
        turn = (0.0, 0.0, angle)
        body.add(
            "geom",
            pos=centre,
            euler=turn,
            size=(thickness, half_width, 0.5 * (depth - chamfer)),
            **touching,
        )
        normal = np.sqrt(0.5) * (out + along)  # into the material
        centre = (r + 0.5 * chamfer) * out + 0.5 * chamfer * along + slab * normal
        across = (r + chamfer) * np.tan(np.pi / _SIDES)
        sideways = np.cross(along, out)
        body.add(
            "geom",
            pos=centre,
            xyaxes=np.concatenate([normal, sideways]),
            size=(slab, across, slope),
            **touching,
        )
    half = 0.5 * receptacle.bottom_m
    body.add("geom", pos=(0, 0, depth + half), size=(outer, outer, half), **touching)


def _add_panel(body: Any, receptacle: Receptacle, touching: dict[str, Any]) -> None:
    """Add four boards around the receptacle, which the arm's links can touch as well."""
    width, height = (0.5 * edge for edge in receptacle.panel_m)
    hole, half = receptacle.outer_radius_m, 0.01
    z = receptacle.panel_behind_m + half
    side, above = 0.5 * (width - hole), 0.5 * (height - hole)
    for sign in (-1.0, 1.0):
        body.add("geom", pos=(sign * (hole + side), 0, z), size=(side, height, half), **touching)
        body.add("geom", pos=(0, sign * (hole + above), z), size=(hole, above, half), **touching)


def _add_looks(root: Any, body: Any, receptacle: Receptacle) -> None:
    r, depth, chamfer, outer = (
        receptacle.bore_radius_m,
        receptacle.depth_m,
        receptacle.chamfer_m,
        receptacle.outer_radius_m,
    )
    end = depth + receptacle.bottom_m
    material = root.asset.add(
        "material", name="bronze", rgba=(0.72, 0.56, 0.33, 1), specular=0.8, shininess=0.6
    )
    profile = [(0.0, end), (outer, end), (outer, 0.004), (outer - 0.004, 0.0), (r + chamfer, 0.0)]
    profile += [(r, chamfer), (r, depth), (0.0, depth)]
    mesh = add_revolved_mesh(root, "housing", profile[::-1])
    body.add("geom", type="mesh", mesh=mesh, material=material, **UNTOUCHABLE)


def joints_at(pose: Array) -> Array:
    """Return the joint positions that put the receptacle at a pose. Shape (6,) [m, rad]."""
    first, second, third = (FACING.T @ rotation(pose)).tolist()  # = Rx(a) Ry(b) Rz(c)
    out = np.empty(6)
    out[:3] = pose[:3]
    out[3] = math.atan2(-second[2], third[2])
    out[4] = math.asin(min(max(first[2], -1.0), 1.0))
    out[5] = math.atan2(-first[1], first[0])
    return out
