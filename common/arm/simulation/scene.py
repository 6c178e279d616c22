"""The whole scene: MJCF of arm and receptacle in water, with lights and cameras."""

from __future__ import annotations

from functools import cache
from typing import Any

from farhand.common.arm.arm import make_arm
from farhand.common.arm.dimensions import Dimensions
from farhand.common.arm.engine import MjModel, mjcf, mujoco
from farhand.common.arm.simulation.receptacle import make_receptacle
from farhand.common.arm.simulation.scenery import add_scenery

STEP_S = 0.002


def make_scene(dimensions: Dimensions) -> Any:
    """The scene's MJCF root."""
    root = mjcf.RootElement(model="scene")
    root.attach(make_arm(dimensions))
    root.attach(make_receptacle(dimensions))
    water = dimensions.water
    option = root.option
    option.timestep = STEP_S
    # Implicit in the joints' damping alone: the derivatives of the water's drag, which is weak here, would
    # make a step four times as long.
    option.integrator = "Euler"
    option.cone = "elliptic"
    option.impratio = 10
    option.density, option.viscosity = water.density_kg_m3, water.viscosity_pa_s
    add_scenery(root, dimensions)
    return root


@cache
def _compiled(dimensions: Dimensions) -> MjModel:
    root = make_scene(dimensions)
    return mujoco.MjModel.from_xml_string(root.to_xml_string(), root.get_assets())


def compile_scene(dimensions: Dimensions) -> MjModel:
    """The scene's model, to be changed by its owner alone."""
    return _compiled(dimensions).__copy__()
