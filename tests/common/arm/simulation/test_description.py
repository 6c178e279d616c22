"""The description of the arm against the model that it was read from."""

from __future__ import annotations

import numpy as np
import pytest

from farhand.common.arm.cell import HIDDEN, Cell, Plug
from farhand.common.arm.engine import mujoco
from farhand.common.arm.kinematics import Kinematics, compose
from farhand.common.arm.simulation.description import describe, sketch
from farhand.common.arm.simulation.disturbances import Surroundings
from farhand.common.arm.simulation.simulation import Simulation
from farhand.common.model.manifold import POSE
from farhand.common.wire.scene_description import SceneDescription
from tests.cells import JACO

SCENE = describe(JACO)


def test_the_tip_is_where_the_kinematics_have_it() -> None:
    kinematics, random = Kinematics(JACO), np.random.default_rng(1)
    for _ in range(5):
        joints = np.array(JACO.robot.home_rad) + random.normal(0.0, 0.4, 6)
        kinematics.update(joints)
        np.testing.assert_allclose(POSE.log(kinematics.tip, SCENE.tip_pose(joints)), 0.0, atol=1e-9)


def test_what_is_drawn_is_where_the_physics_have_it() -> None:
    """The box around the arm and the one around the receptacle, against the model's own vertices."""
    joints, simulation = np.array(JACO.robot.home_rad) + 0.3, Simulation(JACO)
    simulation.reset(joints, Surroundings.still(JACO))
    poses = SCENE.link_poses(joints)
    parts = [(pose, link.meshes) for pose, link in zip(poses, SCENE.links, strict=True)]
    for drawn, name in (
        ([*parts, (poses[-1], SCENE.held)], ("arm/", "tool/")),
        ([(simulation.mouth, SCENE.receptacle)], "receptacle/"),
    ):
        seen = np.concatenate([placed(pose, mesh.vertices_m) for pose, part in drawn for mesh in part])
        expected = vertices_of(simulation, name)
        np.testing.assert_allclose(seen.min(axis=0), expected.min(axis=0), atol=4e-3)
        np.testing.assert_allclose(seen.max(axis=0), expected.max(axis=0), atol=4e-3)


@pytest.mark.parametrize("scene", [SCENE, sketch(JACO)], ids=["drawing", "sketch"])
def test_meshes_are_closed_and_look_outwards(scene: SceneDescription) -> None:
    """The volume that the triangles enclose is positive for each colour of the plug and of the receptacle."""
    for mesh in (*scene.held, *scene.receptacle, *scene.platform):
        a, b, c = np.moveaxis(mesh.vertices_m[mesh.triangles].astype(float), 1, 0)
        assert np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0 > 0.0


def test_another_plug_is_another_description() -> None:
    assert SceneDescription.from_bytes(SCENE.content) == SCENE
    assert describe(Cell(robot=JACO.robot, plug=Plug(radius_m=0.015))).sha256 != SCENE.sha256
    assert len(SCENE.content) < 300_000


def placed(pose: np.ndarray, vertices: np.ndarray) -> np.ndarray:
    out = np.column_stack([vertices, np.ones(len(vertices)), np.zeros((len(vertices), 3))]).astype(float)
    return np.array([compose(pose, each)[:3] for each in out])


def vertices_of(simulation: Simulation, name: str | tuple[str, ...]) -> np.ndarray:
    """Corners of all meshes and boxes that are drawn; what is round lies within them, but for 4 mm."""
    model, data = simulation.model_and_data()
    points = []
    for geom in np.flatnonzero(model.geom_group != HIDDEN):
        if not model.body(model.geom_bodyid[geom]).name.startswith(name):
            continue
        mesh, local = model.geom_dataid[geom], np.zeros((0, 3))
        if mesh >= 0:
            local = model.mesh_vert[model.mesh_vertadr[mesh] :][: model.mesh_vertnum[mesh]]
        elif model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_BOX:
            local = model.geom_size[geom] * np.stack(np.meshgrid(*[(-1, 1)] * 3), axis=-1).reshape(-1, 3)
        points.append(data.geom_xpos[geom] + local @ data.geom_xmat[geom].reshape(3, 3).T)
    return np.concatenate(points)
