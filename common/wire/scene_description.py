"""Description of an arm and its surroundings for drawing: links, joints and shapes.

The robot's site makes it from the compiled model (`farhand.common.arm.simulation.description`), so that the
operator's site needs no physics and draws the actual robot. It is one value, identified by its hash.
"""

from __future__ import annotations

import hashlib
from functools import cached_property
from typing import Annotated, TypeAlias

import msgpack
import msgspec
import numpy as np
from msgspec import Meta, Struct
from numpy.typing import ArrayLike, NDArray

from farhand.common.errors import InvalidMessage
from farhand.common.model.manifold import POSE
from farhand.common.model.task_frame import TaskFrame
from farhand.common.names import Name
from farhand.common.whole_file import fault_of

Array: TypeAlias = NDArray[np.float64]
Colour = Annotated[tuple[int, int, int], Meta(description="sRGB, 0 to 255")]
Triple = tuple[float, float, float]
Pose = tuple[float, float, float, float, float, float, float]


class Mesh(Struct, frozen=True, forbid_unknown_fields=True, array_like=True):
    """Triangles of one colour, in the axes of the body that they belong to."""

    colour: Colour
    vertices: bytes
    """Half precision, shape (V, 3) [m]: good for 0.2 mm within half a metre of the body's origin."""
    faces: bytes
    """Unsigned integers of 16 bits, shape (F, 3)."""

    @classmethod
    def of(cls, colour: Colour, vertices_m: ArrayLike, faces: ArrayLike) -> Mesh:
        """Make a mesh from triangles.

        Args:
            colour: Colour of the mesh.
            vertices_m: Vertices, at most 65536. Shape (V, 3) [m].
            faces: Indices of vertices, counter-clockwise from outside. Shape (F, 3).
        """
        return cls(colour, np.asarray(vertices_m, "<f2").tobytes(), np.asarray(faces, "<u2").tobytes())

    @property
    def vertices_m(self) -> NDArray[np.float32]:
        """Vertices. Shape (V, 3) [m]."""
        return np.frombuffer(self.vertices, "<f2").reshape(-1, 3).astype(np.float32)

    @property
    def triangles(self) -> NDArray[np.uint32]:
        """Indices of vertices. Shape (F, 3)."""
        return np.frombuffer(self.faces, "<u2").reshape(-1, 3).astype(np.uint32)


class ArmLink(Struct, frozen=True, forbid_unknown_fields=True, array_like=True):
    """Rigid part of the arm."""

    name: Name
    parent: int
    """Index of the link that carries it; -1 for the base, which stands at the origin."""
    pose: Pose
    """Pose in its parent's axes while its joint is at zero."""
    axis: Triple
    """Axis of its joint, through its origin, in its own axes; zero for the base."""
    meshes: tuple[Mesh, ...]


class SceneDescription(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, dict=True):
    """Arm from its base to its tool, with its receptacle and its platform.

    Poses are points of `farhand.common.model.manifold.POSE`.
    """

    links: Annotated[tuple[ArmLink, ...], Meta(min_length=2, max_length=16)]
    """The base first, each after its parent; every link but the base has one joint, in this order."""
    tip: Pose
    """Pose of the tool's tip in the last link."""
    held: tuple[Mesh, ...]
    """Object that the tool holds, in the last link."""
    home_rad: tuple[float, ...]
    """Joint angles at rest [rad]."""
    receptacle: tuple[Mesh, ...]
    """Receptacle, in the axes of the task frame."""
    platform: tuple[Mesh, ...]
    """Stationary surroundings of the arm's base."""

    @classmethod
    def from_bytes(cls, data: bytes) -> SceneDescription:
        """Decode a description from bytes.

        Raises:
            InvalidMessage: When they are something else, a link comes before its parent, or a mesh is broken.
        """
        with fault_of("scene", InvalidMessage, "MessagePack"):
            scene = msgspec.convert(msgpack.unpackb(data), cls, builtin_types=(bytes,))
            scene._check()
            return scene

    @cached_property
    def content(self) -> bytes:
        """Return the bytes of the description."""
        return msgpack.Packer().pack(msgspec.to_builtins(self, builtin_types=(bytes,)))

    @cached_property
    def sha256(self) -> str:
        """SHA-256 of the description's bytes."""
        return hashlib.sha256(self.content).hexdigest()

    @property
    def tool(self) -> ArmLink:
        """Last link, which carries the tip."""
        return self.links[-1]

    def link_poses(self, joints_rad: ArrayLike) -> Array:
        """Compute the poses of the links from the base by forward kinematics. Shape (links, 7).

        Args:
            joints_rad: One joint angle for each link but the base [rad].
        """
        angles = np.concatenate([[0.0], np.asarray(joints_rad, dtype=float)])
        out = np.empty((len(self.links), 7))
        for index, (link, angle) in enumerate(zip(self.links, angles, strict=True)):
            pose, turn = np.array(link.pose), np.zeros(6)
            if link.parent >= 0:
                pose = TaskFrame.at(out[link.parent]).to_world(pose)
            turn[3:] = np.multiply(link.axis, angle)
            out[index] = POSE.exp(pose, turn)
        return out

    def tip_pose(self, joints_rad: ArrayLike) -> Array:
        """Compute the pose of the tool's tip from the base. Shape (7,)."""
        return TaskFrame.at(self.link_poses(joints_rad)[-1]).to_world(np.array(self.tip))

    def tool_at(self, tip: Array) -> Array:
        """Return the pose of the last link for a pose of its tip. Shape (7,)."""
        return TaskFrame.at(tip).to_world(TaskFrame.at(np.array(self.tip)).to_local(_AT_ORIGIN))

    def _check(self) -> None:
        for index, link in enumerate(self.links):
            if not -1 <= link.parent < index or (link.parent < 0) != (index == 0):
                raise _invalid(f"links[{index}].parent", "the index of a link before it")
            POSE.checked(link.pose, "scene", f"links[{index}].pose")
        POSE.checked(self.tip, "scene", "tip")
        if len(self.home_rad) != len(self.links) - 1:
            raise _invalid("home_rad", f"{len(self.links) - 1} angles")
        meshes = (*(mesh for link in self.links for mesh in link.meshes), *self.held)
        for mesh in (*meshes, *self.receptacle, *self.platform):
            if len(mesh.vertices) % 6 or len(mesh.faces) % 6:
                raise _invalid("meshes", "whole vertices and triangles")
            if mesh.faces and mesh.triangles.max() >= len(mesh.vertices) // 6:
                raise _invalid("meshes", "triangles of the mesh's own vertices")
            if not np.isfinite(mesh.vertices_m).all():
                raise _invalid("meshes", "finite vertices")


def _invalid(field: str, expected: str) -> InvalidMessage:
    return InvalidMessage("scene", field, expected)


_AT_ORIGIN = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
