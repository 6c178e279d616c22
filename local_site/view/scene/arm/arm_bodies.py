"""Bodies of one or two equal arms, the operator's and the robot's: one batch per colour of each link."""

from __future__ import annotations

import numpy as np
import viser
from numpy.typing import ArrayLike, NDArray

from farhand.common.wire.scene_description import Mesh, SceneDescription
from farhand.local_site.view.scene import palette
from farhand.local_site.view.scene.arm.arm_camera import Half
from farhand.local_site.view.scene.nodes import NO_SHADOW, moved

Array = NDArray[np.float64]

LOCAL, REMOTE = 0, 1
_TINT, _AGED = 0.62, 0.8


class ArmBodies:
    """Links of arms, drawn at their joints. Used by the page's thread.

    Args:
        scene: Scene of the server.
        name: Name of the parent node.
        description: Description of the arms.
        sides: Sides to which the arms belong.
    """

    def __init__(
        self, scene: viser.SceneApi, name: str, description: SceneDescription, sides: tuple[int, ...]
    ):  # fmt: skip
        self._description, self._sides = description, sides
        self._node = scene.add_frame(name, show_axes=False)
        at_rest = description.link_poses(description.home_rad)
        half = Half.of(description)
        self._base_m = [half.base_m(side == REMOTE) for side in sides]
        self._poses = np.stack([self._in_scene(number, at_rest) for number in range(len(sides))])
        """Drawn poses of the links. Shape (sides, links, 7)."""
        self._joints_rad: list[tuple[float, ...]] = [tuple(description.home_rad)] * len(sides)
        self._old = False
        self._batches = [
            [self._add(scene, f"{name}/{link.name}/{k}", index, mesh) for k, mesh in enumerate(link.meshes)]
            for index, link in enumerate(description.links)
        ]
        self._batches[-1] += [
            self._add(scene, f"{name}/held/{k}", -1, mesh) for k, mesh in enumerate(description.held)
        ]

    def remove(self) -> None:
        """Remove the arms from the scene."""
        self._node.remove()

    def draw(self, side: int, joints_rad: ArrayLike) -> None:
        """Show an arm at its joint angles. Shape (6,) [rad]."""
        number = self._sides.index(side)
        joints = tuple(np.asarray(joints_rad, dtype=float).tolist())
        if joints == self._joints_rad[number]:
            return
        self._joints_rad[number] = joints
        poses = self._in_scene(number, self._description.link_poses(joints))
        for index, pose in enumerate(poses):
            if moved(self._poses[number, index], pose):
                self._poses[number, index] = pose
                for batch, _mesh in self._batches[index]:
                    batch.batched_positions = self._poses[:, index, :3].astype(np.float32)
                    batch.batched_wxyzs = self._poses[:, index, 3:].astype(np.float32)

    def draw_age(self, old: bool) -> None:
        """Draw the robot in grey if its report is old, else in its colours."""
        if old != self._old:
            self._old = old
            for batches in self._batches:
                for batch, mesh in batches:
                    batch.batched_colors = self._colours(mesh)

    def _add(
        self, scene: viser.SceneApi, name: str, index: int, mesh: Mesh
    ) -> tuple[viser.BatchedMeshHandle, Mesh]:
        batch = scene.add_batched_meshes_simple(
            name, mesh.vertices_m, mesh.triangles, self._poses[:, index, 3:], self._poses[:, index, :3],
            batched_colors=self._colours(mesh), lod="off", **NO_SHADOW,
        )  # fmt: skip
        return batch, mesh

    def _colours(self, mesh: Mesh) -> NDArray[np.uint8]:
        """Return the colours: arms in blue and amber, tools in their own; grey if a report is old."""
        tint = 0.0 if mesh in self._description.held else _TINT
        local, remote = (palette.mixed(mesh.colour, site, tint) for site in (palette.LOCAL, palette.REMOTE))
        if self._old:
            remote = palette.mixed(mesh.colour, palette.OLD, _AGED)
        return palette.many([remote if side == REMOTE else local for side in self._sides])

    def _in_scene(self, number: int, poses: Array) -> Array:
        out = poses.copy()
        out[:, :3] += self._base_m[number]
        return out
