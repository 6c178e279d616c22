"""What an arm looks like, as a value: its bytes, its hash, its kinematics, and what is refused."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from farhand.common.errors import InvalidMessage
from farhand.common.wire.scene_description import ArmLink, Mesh, SceneDescription

AT_ORIGIN = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
UP = (0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0)
TRIANGLE = Mesh.of((10, 20, 30), np.eye(3), [[0, 1, 2]])
SCENE = SceneDescription(
    links=(
        ArmLink("base", -1, AT_ORIGIN, (0.0, 0.0, 0.0), (TRIANGLE,)),
        ArmLink("upper", 0, UP, (0.0, 1.0, 0.0), (TRIANGLE,)),
        ArmLink("lower", 1, UP, (0.0, 1.0, 0.0), ()),
    ),
    tip=(0.0, 0.0, 0.5, 1.0, 0.0, 0.0, 0.0),
    held=(),
    home_rad=(0.0, 0.0),
    receptacle=(TRIANGLE,),
    platform=(),
)


def test_it_comes_back_from_its_bytes_with_the_same_hash() -> None:
    again = SceneDescription.from_bytes(SCENE.content)
    assert again == SCENE
    assert again.sha256 == SCENE.sha256
    assert msgspec.structs.replace(SCENE, home_rad=(0.0, 0.1)).sha256 != SCENE.sha256
    np.testing.assert_allclose(again.links[0].meshes[0].vertices_m, np.eye(3))
    np.testing.assert_array_equal(again.links[0].meshes[0].triangles, [[0, 1, 2]])


def test_an_arm_of_two_links_in_the_plane_is_where_sines_and_cosines_say() -> None:
    for a, b in ((0.0, 0.0), (0.3, -1.2), (2.0, 1.5)):
        elbow = [np.sin(a), 0.0, 1.0 + np.cos(a)]
        tip = elbow + 0.5 * np.array([np.sin(a + b), 0.0, np.cos(a + b)])
        np.testing.assert_allclose(SCENE.link_poses((a, b))[2, :3], elbow, atol=1e-12)
        np.testing.assert_allclose(SCENE.tip_pose((a, b))[:3], tip, atol=1e-12)


def test_the_tool_is_where_its_tip_says() -> None:
    joints = (0.4, 0.9)
    np.testing.assert_allclose(
        SCENE.tool_at(SCENE.tip_pose(joints)), SCENE.link_poses(joints)[-1], atol=1e-12
    )


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"links": (SCENE.links[0], msgspec.structs.replace(SCENE.links[1], parent=1))}, "parent"),
        ({"links": SCENE.links[:1]}, "links"),
        ({"home_rad": (0.0,)}, "home_rad"),
        ({"tip": (0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0)}, "tip"),
        ({"held": (Mesh((0, 0, 0), b"\0" * 5, b""),)}, "meshes"),
        ({"held": (Mesh.of((0, 0, 0), np.eye(3), [[0, 1, 3]]),)}, "meshes"),
        ({"held": (Mesh.of((0, 0, 0), np.full((3, 3), np.nan), [[0, 1, 2]]),)}, "meshes"),
    ],
)
def test_a_broken_one_is_refused_with_its_field(change: dict, field: str) -> None:
    broken = msgspec.structs.replace(SCENE, **change)
    with pytest.raises(InvalidMessage, match=field):
        SceneDescription.from_bytes(broken.content)


@pytest.mark.parametrize("data", [b"", b"\xc1", b"\x93\x01\x02\x03", SCENE.content[:-3]])
def test_what_is_none_is_refused(data: bytes) -> None:
    with pytest.raises(InvalidMessage):
        SceneDescription.from_bytes(data)
