"""Arm with its tool: the model of a robot file, attached to a scene, and the plug that it holds."""

from __future__ import annotations

from typing import Any

import numpy as np

from farhand.common.arm.cell import HIDDEN, PLUG, UNTOUCHABLE, Cell, Plug
from farhand.common.arm.engine import MjSpec, mjcf, mujoco
from farhand.common.arm.revolved_mesh import add_revolved_mesh
from farhand.common.arm.robot_file import RobotFile
from farhand.common.arm.robot_model import arm_spec

ARM, _TOOL = "arm/", "tool/"
"""Prefixes of all names of the arm and of its tool in a scene."""
TIP, HELD = f"{_TOOL}tip", f"{_TOOL}plug"
"""Site of the tip, and the body with everything that the arm holds."""


def joint_names(robot: RobotFile) -> list[str]:
    """Return the names of the joints in a scene."""
    return [ARM + name for name in robot.joints]


def tool_name(robot: RobotFile) -> str:
    """Return the name in a scene of the body with everything behind the wrist."""
    return ARM + robot.mount.body


def add_arm(scene: MjSpec, cell: Cell) -> None:
    """Attach the arm with its tool to a scene.

    Raises:
        InvalidConfiguration: When its file does not fit its model.
    """
    robot = cell.robot
    base = scene.worldbody.add_body(name=ARM, pos=robot.base.pos_m, quat=robot.base.quat_wxyz)
    scene.attach(arm_spec(robot), prefix=ARM, frame=base.add_frame())
    mount = robot.mount
    hand = scene.body(tool_name(robot))
    tool = mujoco.MjSpec.from_string(_make_tool(cell).to_xml_string())
    scene.attach(tool, prefix=_TOOL, frame=hand.add_frame(pos=mount.pos_m, quat=mount.quat_wxyz))
    ahead_m = np.empty(3)
    mujoco.mju_rotVecQuat(ahead_m, (0.0, 0.0, cell.plug.reach_m), mount.quat_wxyz)
    # Rounded, so that a half turn of the mount is exact.
    hand.add_site(name=TIP, pos=np.round(mount.pos_m + ahead_m, 12), quat=mount.quat_wxyz)


def _make_tool(cell: Cell) -> Any:
    """Build the tool in the mount's axes, with the scene's only sensors: force and torque of the wrist."""
    root = mjcf.RootElement(model="tool")
    root.compiler.angle = "radian"
    root.worldbody.add("site", name="wrist")
    _add_plug(root, cell)
    root.sensor.add("force", name="force", site="wrist")
    root.sensor.add("torque", name="torque", site="wrist")
    return root


def _add_plug(root: Any, cell: Cell) -> None:
    plug, contact = cell.plug, cell.contact
    body = root.worldbody.add("body", name="plug", gravcomp=cell.robot.actuation.gravity_compensated)
    r, tip = plug.radius_m, plug.reach_m
    body.add(
        "geom",
        name="plug",
        type="capsule",
        fromto=(0, 0, tip - plug.length_m + r, 0, 0, tip - r),
        size=(r,),
        mass=plug.mass_kg,
        contype=PLUG,
        conaffinity=PLUG,
        condim=3,
        friction=(contact.friction, 0.005, 0.0001),
        solref=contact.solref,
        solimp=contact.solimp,
        group=HIDDEN,
    )
    root.asset.add("material", name="steel", rgba=(0.78, 0.80, 0.82, 1.0), specular=0.9, shininess=0.8)
    root.asset.add("material", name="seal", rgba=(0.04, 0.04, 0.04, 1.0), specular=0.3, shininess=0.3)
    root.asset.add("material", name="handle", rgba=(0.95, 0.45, 0.05, 1.0), specular=0.3, shininess=0.4)
    for name, profile in _plug_profiles(plug).items():
        mesh = add_revolved_mesh(root, f"plug_{name}", profile)
        body.add("geom", type="mesh", mesh=mesh, material=name, **UNTOUCHABLE)


def _plug_profiles(plug: Plug) -> dict[str, list[tuple[float, float]]]:
    """Return the visible profiles of the plug: stock and collar, body with a round tip, three seals."""
    r, tip, back = plug.radius_m, plug.reach_m, plug.reach_m - plug.length_m
    arc = np.linspace(0.0, 0.5 * np.pi, 12)
    nose = [(float(r * np.cos(a)), float(tip - r + r * np.sin(a))) for a in arc[:-1]]
    steel = [(0.0, back + 0.03), (r, back + 0.03), *nose, (0.0, tip)]
    handle = [(0.0, back - 0.05), (0.016, back - 0.05), (0.016, back + 0.02)]
    handle += [(1.45 * r, back + 0.022), (1.45 * r, back + 0.032), (0.0, back + 0.032)]
    seals: list[tuple[float, float]] = [(0.0, tip - 0.070)]
    for z in (0.066, 0.048, 0.030):
        ring = ((0.9 * r, -0.0022), (r + 3e-4, -0.0015), (r + 3e-4, 0.0015), (0.9 * r, 0.0022))
        seals += [(radius, tip - z + along) for radius, along in ring]
    seals.append((0.0, tip - 0.026))
    return {"steel": steel, "handle": handle, "seal": seals}
