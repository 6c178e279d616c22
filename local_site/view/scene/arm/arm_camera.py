"""Places of the two arms in the scene by their descriptions, and the cameras that look at them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from farhand.common.model.task_frame import TaskFrame
from farhand.common.wire.scene_description import SceneDescription
from farhand.local_site.view.panels.words.controls import ViewName

Array = NDArray[np.float64]

FOV_RAD = 0.30
"""Vertical field of view: narrow, so that both arms are seen from nearly the same side [rad]."""
_HEADING_RAD, _PITCH_RAD = math.radians(52.0), math.radians(-20.0)
"""Usual direction of sight: from beside and behind the arms at their receptacles, down a little."""
_CENTRE_M = np.array([-0.08, 0.0, -0.09])
"""Point in the middle of the usual extent, from the tip at rest [m]."""
_WIDTH_M, _HEIGHT_M = 1.28, 1.0
"""Usual extent: the arm at rest, and its receptacle wherever that may be [m]."""
_MOUTH_M = np.array([0.18, 0.0, -0.04])
"""Usual place of a receptacle, from the tip at rest [m]."""
_MARGIN_M = 0.05
"""Space around an arm that needs more than the usual extent [m]."""


def _axes(heading_rad: float, pitch_rad: float) -> tuple[Array, Array, Array]:
    """Return the directions across, forwards and up of a camera. Each of shape (3,)."""
    across = np.array([math.sin(heading_rad), -math.cos(heading_rad), 0.0])
    level = math.cos(pitch_rad)
    forwards = np.array([level * math.cos(heading_rad), level * math.sin(heading_rad), math.sin(pitch_rad)])
    return across, forwards, np.cross(across, forwards)


@dataclass(frozen=True, eq=False)
class Half:
    """Half of the scene that one arm needs, from its base, as the usual camera sees it.

    Args:
        centre_m: Point in the middle. Shape (3,) [m].
        width_m: Extent across [m].
        height_m: Extent upwards [m].
        mouth_m: Usual place of the receptacle. Shape (3,) [m].
    """

    centre_m: Array
    width_m: float
    height_m: float
    mouth_m: Array

    @classmethod
    def of(cls, description: SceneDescription) -> Half:
        """Return the usual extent about the tip at rest, and more for an arm that needs more.

        What stands at the base counts as far as the arm reaches.
        """
        tip_m = description.tip_pose(description.home_rad)[:3]
        across, _, up = _axes(_HEADING_RAD, _PITCH_RAD)
        arm_m, centre_m, extents = _at_rest(description), tip_m + _CENTRE_M, []
        for axis, usual_m in ((across, _WIDTH_M), (up, _HEIGHT_M)):
            middle, seen = float(centre_m @ axis), arm_m @ axis
            low = min(middle - 0.5 * usual_m, float(seen.min()) - _MARGIN_M)
            high = max(middle + 0.5 * usual_m, float(seen.max()) + _MARGIN_M)
            centre_m = centre_m + (0.5 * (low + high) - middle) * axis
            extents.append(high - low)
        return cls(centre_m, *extents, mouth_m=tip_m + _MOUTH_M)

    def base_m(self, remote: bool) -> Array:
        """Return the place of the arm's base in the scene, whose middle is between the halves. Shape (3,) [m]."""
        across, _, _ = _axes(_HEADING_RAD, _PITCH_RAD)
        return (0.5 if remote else -0.5) * self.width_m * across - self.centre_m


def _at_rest(description: SceneDescription) -> Array:
    """Return the corners of an arm at rest, from its base. Shape (n, 3) [m]."""
    poses = description.link_poses(description.home_rad)
    steps = [link.pose[:3] for link in description.links[2:]] + [description.tip[:3]]
    reach_m = sum(float(np.linalg.norm(step)) for step in steps)
    corners = [poses[:, :3]]
    for link, pose in zip(description.links, poses, strict=True):
        for mesh in link.meshes:
            seen = TaskFrame.at(pose).to_world(mesh.vertices_m.astype(float))
            near = np.linalg.norm(seen - poses[1, :3], axis=1) <= reach_m
            corners.append(seen[near])
    return np.concatenate(corners)


@dataclass(frozen=True, eq=False)
class ArmCamera:
    """Camera on the arms.

    Args:
        centre_m: Point of the scene in the middle of the canvas. Shape (3,) [m].
        pixels_per_m: Scale at that point.
        size_px: Width and height of the canvas.
        heading_rad: Direction of sight about the vertical.
        pitch_rad: Direction of sight above the horizontal.
    """

    centre_m: Array
    pixels_per_m: float
    size_px: tuple[float, float]
    heading_rad: float = _HEADING_RAD
    pitch_rad: float = _PITCH_RAD

    @property
    def distance_m(self) -> float:
        """Distance of the camera from the centre [m]."""
        return 0.5 * self.size_px[1] / self.pixels_per_m / math.tan(0.5 * FOV_RAD)

    @property
    def position_m(self) -> Array:
        """Position of the camera. Shape (3,) [m]."""
        return self.centre_m - self.distance_m * _axes(self.heading_rad, self.pitch_rad)[1]

    def pixel(self, point_m: Array) -> tuple[float, float]:
        """Project a point of the scene onto the canvas, from its upper left corner [px]."""
        across, forwards, up = _axes(self.heading_rad, self.pitch_rad)
        sight = np.asarray(point_m) - self.position_m
        scale = self.pixels_per_m * self.distance_m / float(sight @ forwards)
        width, height = self.size_px
        return 0.5 * width + scale * float(sight @ across), 0.5 * height - scale * float(sight @ up)


@dataclass(frozen=True, eq=False)
class _View:
    """Named view: its direction, its centre, and the extent that it shows at least [m]."""

    centre_m: Array
    width_m: float
    height_m: float
    heading_rad: float = _HEADING_RAD
    pitch_rad: float = _PITCH_RAD


VIEWS: tuple[str, ...] = tuple(ViewName)
"""Names of the views; the first one shows all."""
TEACHING_VIEW: str = ViewName.BEHIND
"""Name of the view in which the arrows at the plug are best told apart."""


def _view(name: str, own: Half, robot: Half) -> _View:
    mine, remote = own.base_m(remote=False), robot.base_m(remote=True)
    across, _, _ = _axes(_HEADING_RAD, _PITCH_RAD)
    middle_m = 0.5 * (robot.width_m - own.width_m) * across
    width_m, height_m = own.width_m + robot.width_m, max(own.height_m, robot.height_m)
    views: dict[str, _View] = {
        ViewName.BOTH: _View(middle_m, width_m, height_m),
        ViewName.MINE: _View(mine + own.centre_m, own.width_m, own.height_m),
        ViewName.ROBOT: _View(remote + robot.centre_m, robot.width_m, robot.height_m),
        ViewName.BEHIND: _View(mine + own.mouth_m, 0.8, 0.62, math.radians(24.0), math.radians(-38.0)),
        ViewName.BORE: _View(remote + robot.mouth_m, 0.5, 0.42, math.radians(66.0), math.radians(-12.0)),
        ViewName.TOP: _View(middle_m, width_m, height_m, _HEADING_RAD, math.radians(-80.0)),
    }
    return views[name]


def arm_camera(size_px: tuple[float, float], own: Half, robot: Half, view: str = VIEWS[0]) -> ArmCamera:
    """Return a camera that fits a view into a canvas.

    Args:
        size_px: Width and height of the canvas.
        own: Half of the operator's arm.
        robot: Half of the robot.
        view: Name of the view.
    """
    shown = _view(view, own, robot)
    scale = min(size_px[0] / shown.width_m, size_px[1] / shown.height_m)
    return ArmCamera(shown.centre_m, scale, size_px, shown.heading_rad, shown.pitch_rad)
