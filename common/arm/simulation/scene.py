"""Scene as MJCF: arm and receptacle in water, with lights, cameras and scenery for display only."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from farhand.common.arm.arm import add_arm
from farhand.common.arm.cell import UNTOUCHABLE, Cell
from farhand.common.arm.engine import MjcfElement, MjModel, MjSpec, mjcf, mujoco
from farhand.common.arm.revolved_mesh import add_revolved_mesh
from farhand.common.arm.simulation.receptacle import make_receptacle

STEP_S = 0.002


def make_scene(cell: Cell) -> MjSpec:
    """Build the scene, to be compiled: scenery, arm, receptacle.

    Raises:
        InvalidConfiguration: When the robot's file does not fit its model.
    """
    scene = mujoco.MjSpec.from_string(_make_scenery(cell).to_xml_string())
    add_arm(scene, cell)
    receptacle = make_receptacle(cell)
    _add_panel(receptacle, receptacle.find("body", "receptacle"), cell)
    spec = mujoco.MjSpec.from_string(receptacle.to_xml_string())
    holder = scene.worldbody.add_body(name="receptacle/")
    scene.attach(spec, prefix="receptacle/", frame=holder.add_frame())
    return scene


def _make_scenery(cell: Cell) -> Any:
    """Build the scene without arm and receptacle, with the options of the physics."""
    root = mjcf.RootElement(model="scene")
    root.compiler.angle = "radian"
    option = root.option
    option.timestep = STEP_S
    # Implicit in the joints' damping alone: the derivatives of the water's drag, which is weak here, would
    # make a step four times as long.
    option.integrator = "Euler"
    option.cone = "elliptic"
    option.impratio = 10
    option.flag.nativeccd = "disable"
    if cell.robot.medium == "water":
        option.density, option.viscosity = cell.water.density_kg_m3, cell.water.viscosity_pa_s
    _add_scenery(root, cell)
    return root


@cache
def _compiled(cell: Cell) -> MjModel:
    return make_scene(cell).compile()


def compile_scene(cell: Cell) -> MjModel:
    """Compile the scene into a model that the caller owns and may change."""
    return _compiled(cell).__copy__()


Point = tuple[float, ...]

OPERATOR, CLOSE_UP = "operator", "close-up"
"""Cameras: over the arm's shoulder, and beside the mouth."""

DECK = ("mount", "deck")
"""Geoms on which the arm stands."""

_WATER = (0.035, 0.18, 0.23)
_SEA_BED_M = -1.30

_MATERIALS: dict[str, tuple[tuple[float, float, float], float, float]] = {
    # name: colour, specular, shininess
    "frame": ((0.16, 0.17, 0.19), 0.4, 0.4),
    "foam": ((0.86, 0.55, 0.08), 0.15, 0.2),
    "tube": ((0.55, 0.58, 0.60), 0.7, 0.6),
    "orange": ((0.88, 0.30, 0.06), 0.3, 0.4),
    "bolt": ((0.70, 0.72, 0.74), 0.9, 0.8),
    "black": ((0.03, 0.03, 0.03), 0.2, 0.2),
}


def _add_scenery(root: MjcfElement, cell: Cell) -> None:
    """Add water, vehicle, lights and cameras."""
    _add_materials(root)
    _add_water(root)
    _add_vehicle(root.worldbody)
    _add_lights(root)
    x, y, z = cell.robot.workplace.middle_m
    _add_camera(root, OPERATOR, (-0.52, -0.92, 0.98), (x - 0.26, y + 0.02, z - 0.14), fovy_deg=42)
    _add_camera(root, CLOSE_UP, (x - 0.32, y - 0.42, z + 0.21), (x - 0.055, y, z - 0.005), fovy_deg=36)


def _add_materials(root: MjcfElement) -> None:
    for name, (colour, specular, shininess) in _MATERIALS.items():
        root.asset.add("material", name=name, rgba=(*colour, 1), specular=specular, shininess=shininess)


def _add_water(root: MjcfElement) -> None:
    """Add the blue-green haze into which everything fades, and a sea bed."""
    visual = root.visual
    root.statistic.extent = 1.0
    root.statistic.center = (0.5, 0.0, 0.3)
    visual.rgba.fog = (*_WATER, 1)
    visual.map.fogstart, visual.map.fogend = 1.35, 4.2
    visual.map.znear, visual.map.zfar = 0.02, 30.0
    visual.map.shadowclip = 1.5
    visual.quality.shadowsize, visual.quality.offsamples = 4096, 8
    getattr(visual, "global").offwidth, getattr(visual, "global").offheight = 1920, 1080
    above = tuple(2.2 * c for c in _WATER)
    root.asset.add(
        "texture",
        name="sea",
        type="skybox",
        builtin="gradient",
        rgb1=above,
        rgb2=_WATER,
        width=256,
        height=256,
    )
    root.asset.add(
        "texture",
        name="sand",
        type="2d",
        builtin="flat",
        mark="random",
        random=0.25,
        rgb1=(0.36, 0.34, 0.27),
        markrgb=(0.27, 0.26, 0.21),
        width=512,
        height=512,
    )
    root.asset.add("material", name="sand", texture="sand", texrepeat=(5, 5), specular=0.05)
    pos, size = (0, 0, _SEA_BED_M), (12, 12, 0.1)
    root.worldbody.add("geom", type="plane", pos=pos, size=size, material="sand", **UNTOUCHABLE)


def _add_vehicle(world: MjcfElement) -> None:
    """Add the porch on which the arm stands."""

    def box(pos: Point, size: Point, material: str, **named: str) -> None:
        world.add("geom", type="box", pos=pos, size=size, material=material, **UNTOUCHABLE, **named)

    def tube(*fromto: float, radius: float = 0.022) -> None:
        world.add("geom", type="capsule", fromto=fromto, size=(radius,), material="tube", **UNTOUCHABLE)

    box((0, 0, -0.02), (0.13, 0.13, 0.02), "frame", name=DECK[0])
    box((-0.16, 0, -0.06), (0.32, 0.36, 0.02), "frame", name=DECK[1])
    for side in (-0.36, 0.36):
        tube(-0.55, side, -0.06, 0.24, side, -0.06)
        tube(-0.55, side, -0.36, 0.18, side, -0.36)
        tube(0.20, side, -0.08, 0.16, side, -0.34, radius=0.018)
        tube(-0.20, side, -0.08, -0.20, side, -0.34, radius=0.018)
        box((-0.36, 0.85 * side, 0.03), (0.10, 0.05, 0.07), "foam")
    tube(0.24, -0.36, -0.06, 0.24, 0.36, -0.06)


def _add_panel(root: MjcfElement, body: MjcfElement, cell: Cell) -> None:
    """Add the panel's face, the ring around the mouth, bolts, two markers, a valve and a capped port."""
    _add_materials(root)
    receptacle = cell.receptacle
    face, outer = receptacle.panel_behind_m, receptacle.outer_radius_m
    width, height = (0.5 * edge for edge in receptacle.panel_m)
    root.asset.add("material", name="paint", rgba=(0.93, 0.70, 0.07, 1), specular=0.35, shininess=0.4)

    def box(pos: Point, size: Point, material: str) -> None:
        _add_geom(root, body, material, type="box", pos=pos, size=size)

    def turned(
        name: str, profile: list[tuple[float, float]], material: str, x: float = 0, y: float = 0
    ) -> None:
        mesh = add_revolved_mesh(root, name, profile)
        _add_geom(root, body, material, type="mesh", mesh=mesh, pos=(x, y, 0))

    box((0, 0, face + 0.011), (width, height, 0.011), "paint")
    for sign in (-1.0, 1.0):
        box((sign * (width + 0.015), 0, face + 0.02), (0.015, height + 0.03, 0.03), "frame")
        box((0, sign * (height + 0.015), face + 0.02), (width, 0.015, 0.03), "frame")
        box((sign * 0.75 * width, height + 0.70, face + 0.06), (0.028, 0.70, 0.028), "frame")
        _add_marker(root, body, (sign * 0.19, -0.17, face - 0.002))
    flange = [(outer, face), (1.55 * outer, face), (1.55 * outer, face - 0.012), (outer, face - 0.012)]
    turned("flange", [*flange[::-1], flange[-1]], "tube")
    ring = [(0.9 * outer, 0.030), (outer + 4e-4, 0.030), (outer + 4e-4, 0.018), (0.9 * outer, 0.018)]
    turned("ring", [*ring, ring[0]][::-1], "orange")
    for angle in 2.0 * np.pi * (np.arange(8) + 0.5) / 8:
        pos = (1.28 * outer * np.cos(angle), 1.28 * outer * np.sin(angle), face - 0.014)
        _add_geom(root, body, "bolt", type="cylinder", pos=pos, size=(0.006, 0.005))
    hub = [(0.0, face), (0.032, face), (0.032, face - 0.02), (0.016, face - 0.024), (0.016, face - 0.05)]
    turned("hub", [*hub, (0.0, face - 0.05)][::-1], "bolt", x=0.19, y=0.14)
    box((0.19, 0.14, face - 0.056), (0.065, 0.011, 0.007), "orange")
    cap = [(0.0, face), (0.045, face), (0.045, face - 0.03), (0.036, face - 0.038), (0.0, face - 0.038)]
    turned("cap", cap[::-1], "black", x=-0.19, y=0.14)


def _add_marker(root: MjcfElement, body: MjcfElement, pos: tuple[float, float, float]) -> None:
    """Add a board of squares for a camera to track."""
    if root.find("material", "squares") is None:
        root.asset.add(
            "texture",
            name="squares",
            type="2d",
            builtin="checker",
            rgb1=(0.95, 0.95, 0.95),
            rgb2=(0.02, 0.02, 0.02),
            width=256,
            height=256,
        )
        root.asset.add("material", name="squares", texture="squares", texrepeat=(2.5, 2.5), specular=0.1)
        root.asset.add("material", name="white", rgba=(0.9, 0.92, 0.92, 1), specular=0.1)
    x, y, z = pos
    _add_geom(root, body, "white", type="box", pos=pos, size=(0.052, 0.052, 0.002))
    _add_geom(root, body, "squares", type="box", pos=(x, y, z - 0.0015), size=(0.042, 0.042, 0.002))


def _add_geom(root: MjcfElement, body: MjcfElement, material: str, **attributes: object) -> None:
    """Add a geom to a body of an attached model, with a material of the scene."""
    body.add("geom", material=root.find("material", material), **attributes, **UNTOUCHABLE)


def _add_lights(root: MjcfElement) -> None:
    """Add two lamps on the vehicle and a weak light from above."""
    head = root.visual.headlight
    head.ambient, head.diffuse, head.specular = (0.16, 0.20, 0.22), (0.06, 0.07, 0.08), (0.0, 0.0, 0.0)
    for pos, strength, shadow in (((-0.25, 0.55, 1.25), 0.85, True), ((-0.10, -0.65, 0.95), 0.45, False)):
        root.worldbody.add(
            "light",
            pos=pos,
            dir=np.array([0.72, 0.0, 0.32]) - pos,
            directional=False,
            castshadow=shadow,
            cutoff=50,
            exponent=4,
            attenuation=(0.7, 0.15, 0.05),
            diffuse=np.array([1.0, 0.98, 0.92]) * strength,
            specular=np.array([0.6, 0.6, 0.6]) * strength,
            ambient=(0.0, 0.0, 0.0),
        )
    root.worldbody.add(
        "light",
        pos=(0.3, 0.0, 3.0),
        dir=(0.1, 0.0, -1.0),
        directional=True,
        castshadow=False,
        diffuse=(0.10, 0.22, 0.26),
        specular=(0.05, 0.1, 0.1),
    )


def _add_camera(root: MjcfElement, name: str, pos_m: Point, at_m: Point, fovy_deg: float) -> None:
    """Add an upright camera that looks at a point."""
    back = np.subtract(pos_m, at_m)
    right = np.cross([0.0, 0.0, 1.0], back)
    up = np.cross(back, right)
    root.worldbody.add("camera", name=name, pos=pos_m, xyaxes=np.concatenate([right, up]), fovy=fovy_deg)
