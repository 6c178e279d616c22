"""Model of a robot file in one form: driven hinges with velocity servos, all else frozen, geoms sorted by use."""

from __future__ import annotations

import os
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np

from farhand.common.arm.cell import HIDDEN, LINK, SHOWN
from farhand.common.arm.engine import MjModel, MjSpec, mujoco
from farhand.common.arm.robot_file import RobotFile

BOARD = "board"
"""Name of the receptacle's panel among the bodies to avoid."""

_LEAST_KG = 1e-3
"""Least mass of what a joint moves: less and its motion cannot be computed [kg]."""
_MOST_KG = 1e3
_LARGEST_BOX_M = 1.0
"""Largest edge of the box that a link's inertia stands for: the water would drag at it [m]."""
_NAMED = 12

_MESH_FILES = (".stl", ".obj", ".msh")
"""Endings of the mesh files that MuJoCo reads."""


def arm_spec(robot: RobotFile) -> MjSpec:
    """Return the model of a robot, to be attached at its base; the caller owns it.

    Raises:
        InvalidConfiguration: When the file does not fit its model; names the field.
    """
    return _arm_spec(robot).copy()


@cache
def _arm_spec(robot: RobotFile) -> MjSpec:
    spec = _read(robot)
    _check_names(robot, spec)
    _freeze(robot, spec)
    for elements in (
        spec.actuators,
        spec.sensors,
        spec.keys,
        spec.equalities,
        spec.tendons,
        spec.cameras,
        spec.lights,
    ):
        for element in list(elements):
            spec.delete(element)
    _sort_geoms(robot, spec)
    for body in spec.bodies[1:]:
        body.gravcomp = robot.actuation.gravity_compensated
    for index, name in enumerate(robot.joints):
        _drive(robot, spec, index, name)
    _check_model(robot, _compiled(robot, spec))
    return spec


def _read(robot: RobotFile) -> MjSpec:
    """Read the model; leave out the visual meshes of a URDF, whose files MuJoCo cannot read."""
    path = robot.path("model")
    if path.suffix == ".xacro":
        raise robot.invalid(
            "model", f"a URDF, which `xacro {path.name} > {path.stem}.urdf` makes, got a xacro file"
        )
    try:
        spec = mujoco.MjSpec.from_file(str(path))
    except ValueError as error:
        raise robot.invalid("model", f"an MJCF or URDF file that MuJoCo reads: {_line(error)}") from error
    if path.suffix == ".urdf":  # its fixed joints would be dissolved, and the flange with them
        spec.compiler.fusestatic, spec.compiler.balanceinertia, spec.strippath = False, True, True
    folder = (
        robot.path("assets") if robot.assets else path.parent / (spec.meshdir or spec.compiler.meshdir or "")
    )
    for mesh in spec.meshes:
        file = Path(mesh.file).name if spec.strippath else mesh.file
        if file and Path(file).suffix.lower() not in _MESH_FILES:
            raise robot.invalid(
                "model", f"collision meshes as STL or OBJ, got {file}: convert it, and name the new file"
            )
        if file and not os.path.isfile(folder / file):  # a name that no disk takes is none
            raise robot.invalid("assets", f"the folder with the mesh {file}, got {folder}")
        mesh.file = file  # a part of another model would keep the path
    spec.meshdir = str(folder)
    for number, geom in enumerate(spec.geoms):
        geom.name = geom.name or f"geom_{number}"
    return spec


def _compiled(robot: RobotFile, spec: MjSpec) -> MjModel:
    try:
        return spec.compile()
    except ValueError as error:
        raise robot.invalid("model", f"a model that MuJoCo compiles: {_line(error)}") from error


def _line(error: ValueError) -> str:
    return " ".join(str(error).split())


def _check_names(robot: RobotFile, spec: MjSpec) -> None:
    """Check that all names are those of the model, and that the joints lead from the base to the tool."""
    hinges = [joint.name for joint in spec.joints if joint.type == mujoco.mjtJoint.mjJNT_HINGE]
    bodies = [body.name for body in spec.bodies[1:]]
    _check_known(robot, "joints", robot.joints, hinges, "hinges")
    _check_known(robot, "frozen", robot.frozen, [joint.name for joint in spec.joints], "joints")
    _check_known(robot, "mount.body", [robot.mount.body], bodies, "bodies")
    names = [*bodies, *(geom.name for geom in spec.geoms), BOARD]
    for number, pair in enumerate(robot.avoid):
        _check_known(robot, f"avoid[{number}].these", pair.these, names, "bodies and geoms")
        _check_known(robot, f"avoid[{number}].those", pair.those, names, "bodies and geoms")
    chain, body = list[str](), spec.body(robot.mount.body)
    while body is not None and body.name != "world":
        chain[:0] = [joint.name for joint in body.joints]
        body = body.parent
    ordered = tuple(name for name in chain if name in robot.joints)
    if ordered != robot.joints:
        expected = (
            f"those between the base and {robot.mount.body}, from the base on: {', '.join(ordered) or 'none'}"
        )
        raise robot.invalid("joints", f"{expected}; got {', '.join(robot.joints)}")


def _check_known(
    robot: RobotFile, field: str, names: Sequence[str] | dict[str, float], known: list[str], kind: str
) -> None:
    for name in names:
        if name not in known:
            some = ", ".join(known[:_NAMED]) + (", ..." if len(known) > _NAMED else "")
            raise robot.invalid(field, f"{kind} of {robot.model} ({some or 'none'}), got {name!r}")


def _freeze(robot: RobotFile, spec: MjSpec) -> None:
    """Turn every other joint into a fixed angle."""
    for joint in list(spec.joints):
        if joint.name in robot.joints:
            continue
        angle, body = robot.frozen.get(joint.name, 0.0), joint.parent
        if angle:
            if joint.type != mujoco.mjtJoint.mjJNT_HINGE or np.any(joint.pos):
                raise robot.invalid("frozen", f"hinges about their body's origin, got {joint.name}")
            turn, quat = np.empty(4), np.empty(4)
            mujoco.mju_axisAngle2Quat(turn, joint.axis / np.linalg.norm(joint.axis), angle)
            mujoco.mju_mulQuat(quat, _quat(spec, body), turn)
            body.quat, body.alt.type = quat, mujoco.mjtOrientation.mjORIENTATION_QUAT
        spec.delete(joint)


def _quat(spec: MjSpec, body: MjSpec) -> np.ndarray:
    if body.alt.type == mujoco.mjtOrientation.mjORIENTATION_QUAT:
        return np.array(body.quat)
    compiler = spec.compiler
    return np.array(spec.resolve_orientation(bool(compiler.degree), compiler.eulerseq, body.alt))


def _sort_geoms(robot: RobotFile, spec: MjSpec) -> None:
    """Have geoms touch as links do or not at all, and be drawn or hidden as the file says."""
    touching = LINK if robot.actuation.self_collision else 0
    for geom in spec.geoms:
        touches = bool(geom.contype or geom.conaffinity)
        geom.contype, geom.conaffinity = (LINK, touching) if touches else (0, 0)
        drawn = geom.group in robot.looks.groups
        if not (touches or drawn):
            spec.delete(geom)
        else:
            geom.group = SHOWN if drawn else HIDDEN


def _drive(robot: RobotFile, spec: MjSpec, index: int, name: str) -> None:
    """Add the velocity servo of a joint."""
    joint, limits, drives = spec.joint(name), robot.limits, robot.actuation
    if drives.armature_kg_m2 is not None:
        joint.armature = drives.armature_kg_m2[index]
    if drives.friction_nm is not None:
        joint.frictionloss = drives.friction_nm[index]
    servo = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    servo.set_to_velocity(kv=drives.gain_nms_rad)
    velocity, torque = limits.velocity_rad_s[index], limits.torque_nm[index]
    servo.ctrllimited = servo.forcelimited = True
    servo.ctrlrange, servo.forcerange = (-velocity, velocity), (-torque, torque)


def _check_model(robot: RobotFile, model: MjModel) -> None:
    """Check angles and masses, which only the compiled model shows."""
    for name, angle in zip(robot.joints, robot.home_rad, strict=True):
        joint = model.joint(name)
        low, high = joint.range
        if joint.limited[0] and not low <= angle <= high:
            raise robot.invalid("home_rad", f"{low:.3f} to {high:.3f} for {name}, got {angle:g}")
        body = int(joint.bodyid[0])
        welded = np.flatnonzero(model.body_weldid == model.body_weldid[body])
        mass_kg = float(model.body_mass[welded].sum())
        if not _LEAST_KG <= mass_kg <= _MOST_KG:
            found = f"{model.body(body).name}, which {name} moves, weighs {mass_kg:g} kg"
            raise robot.invalid("model", f"links of {_LEAST_KG:g} to {_MOST_KG:g} kg: {found}")
    if robot.medium == "water":
        _check_boxes(robot, model)


def _check_boxes(robot: RobotFile, model: MjModel) -> None:
    """Check that no link is a giant to the water, which takes its size from its inertia."""
    for body in range(1, model.nbody):
        mass_kg, inertia = model.body_mass[body], model.body_inertia[body]
        if mass_kg < _LEAST_KG:
            continue
        edge_m = float(np.sqrt(6.0 * max(inertia.sum() - 2.0 * inertia.min(), 0.0) / mass_kg))
        if edge_m > _LARGEST_BOX_M:
            found = f"{model.body(body).name} is a box of {edge_m:.1f} m by its inertia"
            raise robot.invalid("medium", f'"air", or links whose inertias are right: {found}')


def geoms_of(robot: RobotFile, model: MjModel, names: Sequence[str], prefix: str) -> list[str]:
    """Return the geoms that `avoid` names, by the geom or by its body, in a model with the arm under a prefix."""
    found = list[str]()
    for name in names:
        if name == BOARD:
            found.append(BOARD)
            continue
        geom = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, prefix + name)
        if geom >= 0:
            found.append(prefix + name)
            continue
        body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, prefix + name)
        found += [
            model.geom(g).name
            for g in np.flatnonzero(model.geom_bodyid == body).tolist()
            if model.geom_contype[g]
        ]
    return found
