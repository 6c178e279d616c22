"""A robot is a file: the present arm is bit for bit what it was, and what is wrong in a file is said in one line."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from farhand.common.arm.cell import Cell
from farhand.common.arm.engine import MjModel, kinova, mjcf, mujoco
from farhand.common.arm.kinematics import Kinematics
from farhand.common.arm.robot_file import RobotFile, load_robot
from farhand.common.arm.robot_model import arm_spec
from farhand.common.arm.simulation.description import MOST_BYTES, MOST_SKETCH_BYTES, describe, sketch
from farhand.common.arm.simulation.scene import compile_scene
from farhand.common.errors import InvalidConfiguration
from farhand.common.wire.packed import pack
from farhand.deploy.places import find_cell, find_robot, find_task
from tests.cells import JACO

ROBOTS = Path(find_robot("jaco").folder)
NAMES = sorted(file.stem for file in ROBOTS.glob("*.toml"))
ARM = """
schema = 1
name = "small"
model = "small.xml"
joints = ["turn", "bend", "nod"]
home_rad = [0.1, 0.5, -0.5]
home_std_rad = [0.05, 0.05, 0.05]
[mount]
body = "hand"
[limits]
velocity_rad_s = [1.0, 1.0, 1.0]
acceleration_rad_s2 = [5.0, 5.0, 5.0]
torque_nm = [30.0, 30.0, 30.0]
workspace_low_m = [0.2, -0.4, 0.0]
workspace_high_m = [1.1, 0.4, 0.9]
[actuation]
gain_nms_rad = 100.0
armature_kg_m2 = [1.0, 1.0, 1.0]
[[avoid]]
these = ["hand"]
those = ["board"]
[workplace]
low_m = [0.6, -0.1, 0.3]
high_m = [0.7, 0.1, 0.4]
"""
MODEL = """
<mujoco><compiler angle="{angle}"/><worldbody><body name="base">
  <geom name="base" type="cylinder" size="0.06 0.05" mass="2"/>
  <body name="column" pos="0 0 0.1"><joint name="turn" axis="0 0 1" range="-{wide} {wide}" limited="true"/>
    <inertial pos="0 0 0.1" mass="3" diaginertia="0.02 0.02 0.01"/>
    <geom name="column" type="capsule" size="0.05 0.1"/>
    <body name="upper" pos="0 0 0.2" euler="0 {quarter} 0"><joint name="bend" axis="0 1 0" range="-{wide} {wide}" limited="true"/>
      <inertial pos="0 0 0.15" mass="2" diaginertia="0.02 0.02 0.01"/>
      <geom name="upper" type="sphere" size="0.05"/>
      <body name="lower" pos="0 0 0.3"><joint name="nod" axis="0 1 0" range="-{wide} {wide}" limited="true"/>
        <inertial pos="0 0 0.1" mass="1" diaginertia="0.01 0.01 0.005"/>
        <geom name="lower" type="box" size="0.03 0.03 0.1"/>
        <body name="hand" pos="0 0 0.2">
          <inertial pos="0 0 0.02" mass="0.5" diaginertia="0.002 0.002 0.001"/>
          <geom name="hand" type="ellipsoid" size="0.03 0.04 0.05"/>
        </body></body></body></body></body></worldbody></mujoco>
"""
RADIANS = MODEL.format(angle="radian", wide="2", quarter=repr(np.pi / 2))
DEGREES = MODEL.format(angle="degree", wide=repr(float(np.degrees(2.0))), quarter="90")


def robot(folder: Path, arm: str = ARM, model: str = RADIANS, file: str = "small.xml") -> RobotFile:
    (folder / file).write_text(model, encoding="utf-8")
    (folder / "small.toml").write_text(arm, encoding="utf-8")
    return load_robot(folder / "small.toml")


# The present arm ----------------------------------------------------------------------------------


def test_the_jaco_of_the_file_is_the_one_of_dm_control_bit_for_bit():
    """Against an arm made by other means: dm_control's own entities, as the code made it before there were files."""
    arm, hand = kinova.JacoArm(), kinova.JacoHand()
    closed = {"b_finger": 0.95, "b_finger_tip": 0.55}
    for joint in hand.mjcf_model.find_all("joint"):
        w, x, y, z = joint.parent.quat if joint.parent.quat is not None else (1.0, 0.0, 0.0, 0.0)
        half = 0.5 * closed[joint.parent.name.rstrip("_123")]
        c, s = np.cos(half), np.sin(half)
        joint.parent.quat = np.array([w * c - z * s, x * c + y * s, y * c - x * s, z * c + w * s])
        joint.remove(affect_attachments=False)
    for actuator in hand.mjcf_model.find_all("actuator"):
        actuator.remove()
    arm.wrist_site.attach(hand.mjcf_model)
    root = mjcf.RootElement(model="scene")
    root.attach(arm.mjcf_model)
    of_dm_control = mujoco.MjModel.from_xml_string(root.to_xml_string(), root.get_assets())
    of_the_file = compile_scene(JACO)
    n = of_dm_control.nbody - 1  # the world, then the attachment, the arm and its hand
    for field in ("body_pos", "body_quat", "body_mass", "body_inertia", "body_ipos", "body_iquat"):
        np.testing.assert_array_equal(
            getattr(of_the_file, field)[: n + 1], getattr(of_dm_control, field), field
        )
    for field in ("jnt_range", "jnt_limited", "jnt_axis", "dof_armature", "dof_damping", "dof_frictionloss"):
        np.testing.assert_array_equal(getattr(of_the_file, field)[:6], getattr(of_dm_control, field), field)
    for field in ("actuator_ctrlrange", "actuator_forcerange", "actuator_gainprm", "actuator_biasprm"):
        np.testing.assert_array_equal(getattr(of_the_file, field)[:6], getattr(of_dm_control, field), field)


def test_a_point_has_no_robot_file():
    assert find_cell(find_task("planar")) is None
    with pytest.raises(InvalidConfiguration, match="robot: none, as planar is the task of a point"):
        find_cell(find_task("planar"), "jaco")


# Other arms ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", NAMES)
def test_every_robot_that_comes_along_is_drawn_within_the_budget(name: str):
    described = describe(Cell(robot=find_robot(name)))
    assert len(described.links) == len(find_robot(name).joints) + 1
    assert len(described.content) <= MOST_BYTES
    coarse = sketch(Cell(robot=find_robot(name)))
    assert len(pack(coarse.content)) <= MOST_SKETCH_BYTES and coarse.tip == described.tip


def test_degrees_and_radians_are_the_same_scene_bit_for_bit(tmp_path: Path):
    scenes = []
    for number, model in enumerate((RADIANS, DEGREES)):
        (tmp_path / str(number)).mkdir()
        scenes.append(compile_scene(Cell(robot=robot(tmp_path / str(number), model=model))))
    radians, degrees = scenes
    of_jaco = compile_scene(JACO)
    for field in ("body_pos", "body_mass", "geom_pos", "geom_quat", "geom_size"):
        np.testing.assert_array_equal(getattr(radians, field), getattr(degrees, field), field)
    np.testing.assert_allclose(radians.jnt_range, degrees.jnt_range, atol=1e-15)
    for field in ("geom_pos", "geom_quat", "geom_size", "geom_contype"):
        ours, theirs = (getattr(scene, field)[receptacle_of(scene)] for scene in (radians, of_jaco))
        np.testing.assert_array_equal(ours, theirs, field)


def test_joints_that_are_not_driven_stand_still_at_their_angles(tmp_path: Path):
    fixed = ARM.replace('"turn", "bend", "nod"', '"turn", "nod"').replace(
        "home_rad = [0.1, 0.5, -0.5]", "home_rad = [0.1, -0.5]"
    )
    for three, two in (("1.0, 1.0, 1.0", "1.0, 1.0"), ("5.0, 5.0, 5.0", "5.0, 5.0"), ("30.0, 30.0, 30.0", "30.0, 30.0"), ("0.05, 0.05, 0.05", "0.05, 0.05")):  # fmt: skip
        fixed = fixed.replace(three, two)
    fixed = fixed.replace("[mount]", "frozen = { bend = 0.5 }\n[mount]")
    (tmp_path / "two").mkdir()
    two, three = robot(tmp_path / "two", fixed), robot(tmp_path)
    poses = []
    for of in (two, three):
        model = compile_scene(Cell(robot=of))
        data = mujoco.MjData(model)
        data.qpos[: len(of.joints)] = of.home_rad
        mujoco.mj_kinematics(model, data)
        poses.append(data.site("tool/tip").xpos.copy())
    np.testing.assert_allclose(*poses, atol=1e-12)


# Mistakes -----------------------------------------------------------------------------------------


def changed(old: str, new: str, model: bool = False) -> dict[str, str]:
    text = RADIANS if model else ARM
    assert old in text
    return {"model" if model else "arm": text.replace(old, new)}


MISTAKES = {
    "unknown joint": (changed('"nod"]', '"neck"]'), "joints: hinges of small.xml (turn, bend, nod), got 'neck'"),
    "joints out of order": (changed('"turn", "bend"', '"bend", "turn"'), "joints: those between the base and hand, from the base on: turn, bend, nod"),
    "a list too short": (changed("home_rad = [0.1, 0.5, -0.5]", "home_rad = [0.1, 0.5]"), "home_rad: 3 numbers, one for each of joints, got 2"),
    "home out of range": (changed("[0.1, 0.5, -0.5]", "[0.1, 2.5, -0.5]"), "home_rad: -2.000 to 2.000 for bend, got 2.5"),
    "home in degrees": (changed("[0.1, 0.5, -0.5]", "[5.7, 28.6, -28.6]"), "home_rad: at most 7 rad, got 28.6: degrees?"),
    "speed in degrees": (changed("velocity_rad_s = [1.0", "velocity_rad_s = [180.0"), "velocity_rad_s: at most 15 rad/s, got 180: degrees?"),
    "unknown body": (changed('body = "hand"', 'body = "flange"'), "mount.body: bodies of small.xml (base, column, upper, lower, hand), got 'flange'"),
    "unknown geom to avoid": (changed('these = ["hand"]', 'these = ["palm"]'), "avoid[0].these: bodies and geoms of small.xml"),
    "a link of no mass": (changed('mass="1" diaginertia="0.01 0.01 0.005"', 'mass="1e-8" diaginertia="1e-11 1e-11 1e-11"', model=True) | {"hand": "1e-8"}, "links of 0.001 to 1000 kg: lower, which nod moves, weighs"),
    "no such mesh": (changed('<geom name="hand" type="ellipsoid" size="0.03 0.04 0.05"/>', '<geom name="hand" type="mesh" mesh="palm"/>', model=True), "assets: the folder with the mesh palm.stl"),
    "a mesh that MuJoCo cannot read": (changed('<geom name="hand" type="ellipsoid" size="0.03 0.04 0.05"/>', '<geom name="hand" type="mesh" mesh="palm"/>', model=True) | {"mesh": "palm.dae"}, "model: collision meshes as STL or OBJ, got palm.dae: convert it"),
    "xacro": (changed('"small.xml"', '"small.xacro"') | {"file": "small.xacro"}, "model: a URDF, which `xacro small.xacro > small.urdf` makes"),
    "no such model": (changed('"small.xml"', '"large.xml"'), "model: an MJCF or URDF file that exists, got"),
    "a model's name that no disk takes": (
        changed('"small.xml"', f'"{"x" * 300}.xml"'), "model: an MJCF or URDF file that exists, got",
    ),
    "a folder's name that no disk takes": (
        changed('model = "small.xml"', f'model = "small.xml"\nassets = "{"x" * 300}"'), "assets: a folder that exists, got",
    ),
    "a zero byte in a name": (
        changed('"small.xml"', '"small\\u0000.xml"'), "model: text without line feeds or other characters that cannot be shown",
    ),
    "no XML": ({"model": "not XML"}, "model: an MJCF or URDF file that MuJoCo reads"),
    "no such package": (changed('"small.xml"', '"package:no_such_arms:arm.xml"'), "model: an installed Python package, got 'no_such_arms': pip install it"),
    "a quaternion that is none": (changed('body = "hand"', 'body = "hand"\nquat_wxyz = [1, 1, 0, 0]'), "quat_wxyz: four numbers of length 1, w first, got"),
    "an empty workspace": (changed("[1.1, 0.4, 0.9]", "[0.1, 0.4, 0.9]"), "workspace_low_m: below workspace_high_m"),
    "a workplace beyond it": (changed("high_m = [0.7, 0.1, 0.4]", "high_m = [1.9, 0.1, 0.4]"), "workplace: inside the workspace of limits"),
    "water around a giant": (changed('[mount]', 'medium = "water"\n[mount]') | changed("0.02 0.02 0.01", "4 4 4", model=True), 'medium: "air", or links whose inertias are right: column is a box of'),
    "a field of another name": (changed("torque_nm", "torque"), "limits: Object contains unknown field `torque`"),
    "another name than the file": (changed('name = "small"', 'name = "tiny"'), "name: 'small', as the file, got 'tiny'"),
    "nine joints": (changed('joints = ["turn", "bend", "nod"]', 'joints = ["a", "b", "c", "d", "e", "f", "g", "h", "i"]'), "joints: "),
}  # fmt: skip


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_in_a_robot_file_is_refused_in_one_line(mistake: str, tmp_path: Path):
    texts, expected = MISTAKES[mistake]
    model = texts.get("model", RADIANS)
    if "hand" in texts:
        model = model.replace(
            'mass="0.5" diaginertia="0.002 0.002 0.001"', 'mass="1e-8" diaginertia="1e-11 1e-11 1e-11"'
        )
    if "mesh=" in model:
        model = model.replace(
            "<worldbody>", '<asset><mesh name="palm" file="FILE"/></asset><worldbody>'
        ).replace("FILE", texts.get("mesh", "palm.stl"))
    with pytest.raises(InvalidConfiguration) as refused:
        arm_spec(robot(tmp_path, texts.get("arm", ARM), model, texts.get("file", "small.xml")))
    told = str(refused.value)
    assert "small.toml" in told and expected in told and "\n" not in told, told


def test_a_file_that_changes_is_read_again(tmp_path: Path):
    before = robot(tmp_path)
    assert load_robot(tmp_path / "small.toml") is before
    assert (
        robot(tmp_path, ARM.replace("gain_nms_rad = 100.0", "gain_nms_rad = 50.0")).actuation.gain_nms_rad
        == 50.0
    )
    shutil.copy(tmp_path / "small.toml", tmp_path / "other.toml")
    with pytest.raises(InvalidConfiguration, match="'other', as the file"):
        load_robot(tmp_path / "other.toml")


def test_the_panda_is_the_same_arm_from_its_urdf_whose_meshes_are_those_of_a_ros_package():
    urdf, mjcf_ = (Kinematics(Cell(robot=find_robot(name))) for name in ("panda-urdf", "panda"))
    np.testing.assert_allclose(urdf.tip, mjcf_.tip, atol=1e-5)
    np.testing.assert_allclose(urdf.jacobian(), mjcf_.jacobian(), atol=1e-5)
    np.testing.assert_allclose(urdf.model.body_mass, mjcf_.model.body_mass, rtol=1e-5)


URDF = """
<robot name="small">
  <link name="base"><collision><geometry><cylinder radius="0.06" length="0.1"/></geometry></collision></link>
  <link name="column">
    <inertial><origin xyz="0 0 0.1"/><mass value="3"/><inertia ixx="0.02" iyy="0.02" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
  </link>
  <link name="upper">
    <inertial><origin xyz="0 0 0.15"/><mass value="2"/><inertia ixx="0.02" iyy="0.02" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
  </link>
  <link name="lower">
    <inertial><origin xyz="0 0 0.1"/><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.005" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><geometry><box size="0.06 0.06 0.2"/></geometry></collision>
  </link>
  <link name="hand">
    <inertial><origin xyz="0 0 0.02"/><mass value="0.5"/><inertia ixx="0.002" iyy="0.002" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><geometry><sphere radius="0.04"/></geometry></collision>
  </link>
  <joint name="turn" type="revolute"><parent link="base"/><child link="column"/><origin xyz="0 0 0.1"/><axis xyz="0 0 1"/><limit lower="-2" upper="2" effort="30" velocity="1"/></joint>
  <joint name="bend" type="revolute"><parent link="column"/><child link="upper"/><origin xyz="0 0 0.2" rpy="0 1.5707963267948966 0"/><axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="30" velocity="1"/></joint>
  <joint name="nod" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0 0 0.3"/><axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="30" velocity="1"/></joint>
  <joint name="flange" type="fixed"><parent link="lower"/><child link="hand"/><origin xyz="0 0 0.2"/></joint>
</robot>
"""


def test_a_urdf_is_the_same_arm(tmp_path: Path):
    (tmp_path / "urdf").mkdir()
    seen = '<visual><geometry><mesh filename="package://small/hand.dae"/></geometry></visual></link>\n  <joint name="turn"'
    drawn = URDF.replace(
        '</link>\n  <joint name="turn"', seen
    )  # what is only seen is left out, whatever its format
    assert drawn != URDF
    of_urdf = robot(tmp_path / "urdf", ARM.replace("small.xml", "small.urdf"), drawn, "small.urdf")
    urdf, mjcf_ = (Kinematics(Cell(robot=each)) for each in (of_urdf, robot(tmp_path)))
    np.testing.assert_allclose(urdf.tip, mjcf_.tip, atol=1e-9)
    np.testing.assert_allclose(urdf.jacobian(), mjcf_.jacobian(), atol=1e-9)
    assert urdf.tool_weight()[0] == pytest.approx(mjcf_.tool_weight()[0])
    np.testing.assert_allclose(urdf.model.jnt_range, mjcf_.model.jnt_range)
    scenes = [compile_scene(Cell(robot=each)) for each in (of_urdf, robot(tmp_path))]
    for field in ("geom_pos", "geom_quat", "geom_size", "geom_contype"):  # bit for bit
        ours, theirs = (getattr(scene, field)[receptacle_of(scene)] for scene in scenes)
        np.testing.assert_array_equal(ours, theirs, field)


def receptacle_of(scene: MjModel) -> list[int]:
    bodies = [scene.body(scene.geom_bodyid[g]).name for g in range(scene.ngeom)]
    found = [g for g, body in enumerate(bodies) if body.startswith("receptacle")]
    assert len(found) > 30
    return found
