"""Kinova Jaco with its hand, which grips the plug: MJCF."""

from __future__ import annotations

from typing import Any

import numpy as np

from farhand.common.arm.dimensions import HIDDEN, LINK, PLUG, SHOWN, UNTOUCHABLE, Dimensions, Plug
from farhand.common.arm.engine import kinova
from farhand.common.arm.lathe import add_lathe

JOINTS = tuple(f"jaco_arm/joint_{i}" for i in range(1, 7))
TIP = "jaco_arm/jaco_hand/tip"
TOOL = "jaco_arm/jaco_hand/hand"
"""Name of the body of the hand, which carries all links behind the wrist."""
HELD = "jaco_arm/jaco_hand/plug"
"""Name of the body with everything that the hand grips."""

_FORWARDS = (0.0, np.sqrt(0.5), np.sqrt(0.5), 0.0)
"""Quaternion of the wrist's axes in the hand's axes."""
_GRIP_RAD = {"b_finger": 0.95, "b_finger_tip": 0.55}
"""Angle of the closed fingers [rad]."""


def make_arm(dimensions: Dimensions) -> Any:
    """Build the arm with its tool and return its MJCF root, to be attached at the base."""
    arm = kinova.JacoArm()
    arm.wrist_site.attach(_make_tool(dimensions))
    root = arm.mjcf_model
    for body in root.find_all("body"):
        if not body.full_identifier.endswith("/"):  # attachment frames have no such attribute
            body.gravcomp = dimensions.water.buoyancy
    for geom in root.find_all("geom"):
        geom.group = geom.group if geom.group is not None else SHOWN
    _paint(root)
    return root


def _make_tool(dimensions: Dimensions) -> Any:
    """Build the hand with its fingers closed permanently around the plug."""
    root = kinova.JacoHand().mjcf_model
    hand = root.find("body", "hand")
    for joint in root.find_all("joint"):
        body = joint.parent
        angle = _GRIP_RAD[body.name.rstrip("_123")]
        body.quat = _product(body.quat if body.quat is not None else (1.0, 0.0, 0.0, 0.0), angle)
        joint.remove(affect_attachments=False)
    for actuator in root.find_all("actuator"):
        actuator.remove()
    for geom in root.find_all("geom"):
        geom.contype, geom.conaffinity, geom.group = 0, 0, SHOWN
    hand.add("site", name="wrist", quat=_FORWARDS)
    hand.add(
        "geom",
        name="palm",
        type="capsule",
        fromto=(0, 0, -0.03, 0, 0, -0.13),
        size=(0.045,),
        contype=LINK,
        conaffinity=LINK,
        mass=0,
        group=HIDDEN,
    )
    _add_plug(root, hand, dimensions)
    root.sensor.add("force", name="force", site="wrist")
    root.sensor.add("torque", name="torque", site="wrist")
    return root


def _add_plug(root: Any, hand: Any, dimensions: Dimensions) -> None:
    plug, contact = dimensions.plug, dimensions.contact
    body = hand.add("body", name="plug", quat=_FORWARDS, gravcomp=dimensions.water.buoyancy)
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
    hand.add("site", name="tip", pos=(0.0, 0.0, -tip), quat=_FORWARDS)
    root.asset.add("material", name="steel", rgba=(0.78, 0.80, 0.82, 1.0), specular=0.9, shininess=0.8)
    root.asset.add("material", name="seal", rgba=(0.04, 0.04, 0.04, 1.0), specular=0.3, shininess=0.3)
    root.asset.add("material", name="handle", rgba=(0.95, 0.45, 0.05, 1.0), specular=0.3, shininess=0.4)
    for name, profile in _plug_profiles(plug).items():
        mesh = add_lathe(root, f"plug_{name}", profile)
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


def _paint(root: Any) -> None:
    """Add materials that react to light: dark composite links with pale rings."""
    for material in root.find_all("material"):
        if material.name == "dark_gray":
            material.rgba, material.specular, material.shininess = (0.20, 0.21, 0.23, 1.0), 0.7, 0.5
        elif material.name == "light_gray":
            material.rgba, material.specular, material.shininess = (0.75, 0.77, 0.78, 1.0), 0.8, 0.7


def _product(quat: Any, angle_rad: float) -> np.ndarray:
    """Rotate a quaternion further about its own z axis."""
    w, x, y, z = quat
    c, s = np.cos(0.5 * angle_rad), np.sin(0.5 * angle_rad)
    return np.array([w * c - z * s, x * c + y * s, y * c - x * s, z * c + w * s])
