"""Cell: arm, plug, receptacle and water with their dimensions, and the layers of geoms that touch or are drawn.

Plug and receptacle are like those of a hot stab; no conformity with any standard is claimed.
"""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta, Struct

from farhand.common.arm.robot_file import RobotFile

Positive = Annotated[float, Meta(gt=0)]


class Plug(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Tool in the hand: a cylinder with a round tip."""

    radius_m: Positive = 0.0195
    length_m: Positive = 0.120
    reach_m: Positive = 0.280
    """Distance from the wrist to the tip [m]."""
    mass_kg: Positive = 0.6


class Receptacle(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Bore with a chamfered mouth in a panel.

    It yields a little, as a panel on a frame does. This spring bounds the forces: it stops an arm with an
    effective mass of 56 kg and a speed of 0.1 m/s with 0.1 sqrt(56 * 25e3) = 118 N.
    """

    bore_radius_m: Positive = 0.0205
    depth_m: Positive = 0.085
    chamfer_m: Positive = 0.015
    """Width of the chamfer of 45 degrees [m]."""
    outer_radius_m: Positive = 0.055
    bottom_m: Positive = 0.080
    """Thickness of the bottom, enough that no plug comes through [m]."""
    panel_m: tuple[Positive, Positive] = (0.60, 0.60)
    """Width and height of the panel [m]."""
    panel_behind_m: Positive = 0.045
    """Distance of the panel's face behind the mouth [m]."""
    mass_kg: Positive = 12.0
    stiffness_n_m: Positive = 25e3
    inertia_kg_m2: Positive = 0.3
    stiffness_nm_rad: Positive = 800.0


class Contact(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Contact parameters between plug and receptacle."""

    friction: Positive = 0.2
    """Friction of wet steel, assumed."""
    solref: tuple[Positive, Positive] = (0.02, 1.0)
    solimp: Annotated[tuple[Positive, ...], Meta(min_length=5, max_length=5)] = (0.9, 0.95, 0.001, 0.5, 2.0)


class Water(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Properties of the surrounding water."""

    density_kg_m3: Positive = 1000.0
    viscosity_pa_s: Positive = 0.001


class Cell(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Arm with its tool in front of a receptacle: everything that a scene is made from."""

    robot: RobotFile
    plug: Plug = Plug()
    receptacle: Receptacle = Receptacle()
    contact: Contact = Contact()
    water: Water = Water()

    def __post_init__(self) -> None:
        if self.plug.radius_m >= self.receptacle.bore_radius_m:
            raise ValueError("plug.radius_m must be less than receptacle.bore_radius_m")
        if self.receptacle.bore_radius_m + self.receptacle.chamfer_m >= self.receptacle.outer_radius_m:
            raise ValueError("receptacle.outer_radius_m must exceed bore_radius_m + chamfer_m")


# Bits of contype and conaffinity.
LINK = 2
PLUG = 4

SHOWN = 2
"""Group of the drawn geoms."""
HIDDEN = 3
"""Group of geoms for contact only, which are not drawn."""

UNTOUCHABLE = {"contype": 0, "conaffinity": 0, "mass": 0, "group": SHOWN}
"""Attributes of geoms that are only drawn."""
