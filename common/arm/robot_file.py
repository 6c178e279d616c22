"""Robot file: an arm as a file describes it, `NAME.toml` beside an MJCF or URDF; both sites read one for their own arm.

The file says what a model cannot: which joints are driven, where the base stands, which body carries the tool, and
the limits. `robot_model` holds it against the model.
"""

from __future__ import annotations

import importlib.util
import math
import os
from functools import cache
from pathlib import Path
from typing import Annotated, Literal

import msgspec
from msgspec import Meta, Struct

from farhand.common.configuration import check_values
from farhand.common.errors import InvalidConfiguration
from farhand.common.names import Name
from farhand.common.whole_file import fault_of, read_whole

MIN_JOINTS, MAX_JOINTS = 2, 8
_FASTEST_RAD_S, _FURTHEST_RAD = 15.0, 7.0
"""Larger numbers are degrees."""
_UNIT = 1e-3

Positive = Annotated[float, Meta(gt=0)]
Fraction = Annotated[float, Meta(ge=0, le=1)]
NonNegative = Annotated[float, Meta(ge=0)]
Triple = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Joints = Annotated[tuple[float, ...], Meta(min_length=MIN_JOINTS, max_length=MAX_JOINTS)]
PerJoint = Annotated[tuple[Positive, ...], Meta(min_length=MIN_JOINTS, max_length=MAX_JOINTS)]


class Placed(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Pose in another frame."""

    pos_m: Triple = (0.0, 0.0, 0.0)
    quat_wxyz: Quaternion = (1.0, 0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if abs(math.hypot(*self.quat_wxyz) - 1.0) > _UNIT:
            raise ValueError(f"quat_wxyz: four numbers of length 1, w first, got {list(self.quat_wxyz)}")


class Mount(Placed, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Place of the tool: origin at the wrist's sensor, z out of the flange towards the tip."""

    body: str
    """Body of the model that carries the tool; the wrist's sensor is between it and its parent."""


class JointLimits(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Limits of the drives, one number for each joint, and of the tip."""

    velocity_rad_s: PerJoint
    acceleration_rad_s2: PerJoint
    torque_nm: PerJoint
    workspace_low_m: Triple
    """Corner of the box that confines the tip, from the base's surroundings [m]."""
    workspace_high_m: Triple

    def __post_init__(self) -> None:
        _check_box("workspace", self.workspace_low_m, self.workspace_high_m)
        if (fastest := max(self.velocity_rad_s)) > _FASTEST_RAD_S:
            raise ValueError(f"velocity_rad_s: at most {_FASTEST_RAD_S:g} rad/s, got {fastest:g}: degrees?")


class Actuation(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Velocity servos of the simulated drives; what is not said is as in the model."""

    gain_nms_rad: Positive
    """Torque for each rad/s that a joint is too slow [Nms/rad]."""
    armature_kg_m2: PerJoint | None = None
    """Inertias of the motors, seen at the joints: a stiff servo on a light joint shakes without [kg m^2]."""
    friction_nm: Annotated[tuple[NonNegative, ...], Meta(max_length=MAX_JOINTS)] | None = None
    gravity_compensated: Fraction = 1.0
    """Share of the weight of arm and tool that drives and water carry."""
    self_collision: bool = False
    """True if the arm's links touch each other in the simulation."""


class Avoid(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Pairs that the control keeps apart: bodies or geoms of the model, or "board" for the receptacle's panel."""

    these: Annotated[tuple[str, ...], Meta(min_length=1)]
    those: Annotated[tuple[str, ...], Meta(min_length=1)]


class Workplace(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Region in front of the arm in which the simulated receptacle may be."""

    low_m: Triple
    high_m: Triple
    tilt_deg: Annotated[float, Meta(ge=0, le=45)] = 15.0
    """Largest angle between the bore and the x axis [degrees]."""
    first_m: Triple | None = None
    """First place of the mouth [m]; the middle of the region when not given."""

    def __post_init__(self) -> None:
        _check_box("", self.low_m, self.high_m)

    @property
    def middle_m(self) -> Triple:
        """First place of the receptacle's mouth [m]."""
        if self.first_m is not None:
            return self.first_m
        x, y, z = (0.5 * (low + high) for low, high in zip(self.low_m, self.high_m, strict=True))
        return x, y, z


class Looks(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Choice of what is drawn of the model."""

    groups: tuple[Annotated[int, Meta(ge=0, le=5)], ...] = (0, 1, 2)
    """Groups of the geoms that are drawn."""


class RobotFile(Struct, frozen=True, eq=False, kw_only=True, forbid_unknown_fields=True):
    """Arm of 2 to 8 hinge joints with a tool; compared by identity, as one file is read once."""

    schema: Literal[1]
    name: Name
    model: str
    """MJCF or URDF: a path from this file, or package:NAME:PATH for a file in an installed Python package."""
    assets: str = ""
    """Folder of its meshes, in the same form; as the model says when not given."""
    base: Placed = Placed()
    """Pose of the model in its surroundings: x points to the receptacle, z up."""
    medium: Literal["water", "air"] = "air"
    """Medium that drags at the simulated arm; water takes the links' sizes from their inertias."""
    joints: Annotated[tuple[str, ...], Meta(min_length=MIN_JOINTS, max_length=MAX_JOINTS)]
    """Driven joints from the base to the tool: the order of all joint vectors."""
    frozen: dict[str, float] = {}
    """Angles at which other joints stand still [rad]; zero for those that are not named."""
    home_rad: Joints
    """Joint angles at rest, and the posture that a redundant arm returns to [rad]."""
    home_std_rad: Annotated[tuple[NonNegative, ...], Meta(max_length=MAX_JOINTS)]
    """Standard deviation of the angles at which a simulated task begins [rad]."""
    mount: Mount
    limits: JointLimits
    actuation: Actuation
    workplace: Workplace
    avoid: tuple[Avoid, ...] = ()
    looks: Looks = Looks()
    folder: str = ""
    """Folder of the file, set by `load_robot`."""

    def __post_init__(self) -> None:
        n = len(self.joints)
        for name, numbers in self._per_joint().items():
            if numbers is not None and len(numbers) != n:
                raise ValueError(f"{name}: {n} numbers, one for each of joints, got {len(numbers)}")
        if len(set(self.joints)) != n:
            raise ValueError("joints: different names")
        if (furthest := max(map(abs, self.home_rad))) > _FURTHEST_RAD:
            raise ValueError(f"home_rad: at most {_FURTHEST_RAD:g} rad, got {furthest:g}: degrees?")
        limits, place = self.limits, self.workplace
        for at, low, high in zip(
            place.middle_m, limits.workspace_low_m, limits.workspace_high_m, strict=True
        ):
            if not low <= at <= high:
                raise ValueError(f"workplace: inside the workspace of limits, got {list(place.middle_m)}")

    def _per_joint(self) -> dict[str, tuple[float, ...] | None]:
        limits, drives = self.limits, self.actuation
        return {
            "home_rad": self.home_rad,
            "home_std_rad": self.home_std_rad,
            "limits.velocity_rad_s": limits.velocity_rad_s,
            "limits.acceleration_rad_s2": limits.acceleration_rad_s2,
            "limits.torque_nm": limits.torque_nm,
            "actuation.armature_kg_m2": drives.armature_kg_m2,
            "actuation.friction_nm": drives.friction_nm,
        }

    @property
    def source(self) -> str:
        """File that describes the robot, for errors."""
        return str(Path(self.folder) / f"{self.name}.toml")

    def invalid(self, field: str, expected: str) -> InvalidConfiguration:
        """Return the error of a field of the file."""
        return InvalidConfiguration(self.source, field, expected)

    def path(self, field: Literal["model", "assets"]) -> Path:
        """Return where the model, or the folder of its meshes, is.

        Raises:
            InvalidConfiguration: When it is not there.
        """
        text = getattr(self, field)
        path = Path(self.folder) / text
        if text.startswith("package:"):
            _, package, inside = (*text.split(":", 2), "", "")[:3]
            found = importlib.util.find_spec(package) if package.isidentifier() else None
            if found is None or not found.submodule_search_locations:
                raise self.invalid(field, f"an installed Python package, got {package!r}: pip install it")
            path = Path(found.submodule_search_locations[0]) / inside
        is_there = os.path.isfile if field == "model" else os.path.isdir  # a name that no disk takes is none
        if not is_there(path):
            kind = "an MJCF or URDF file" if field == "model" else "a folder"
            raise self.invalid(field, f"{kind} that exists, got {path}")
        return path


def load_robot(path: Path) -> RobotFile:
    """Read a robot file; `robot_model.check` holds it against its model.

    Raises:
        InvalidConfiguration: When the file cannot be read, or a field is unknown, missing or wrong.
    """
    with fault_of(path, InvalidConfiguration, "a TOML file in UTF-8"):
        return _robot(path.resolve(), read_whole(path, 1_000_000))


@cache
def _robot(path: Path, content: bytes) -> RobotFile:
    plain = msgspec.toml.decode(content.decode("utf-8-sig"))
    check_values(plain, str(path))
    if plain.get("name") != path.stem:
        raise InvalidConfiguration(
            str(path), "name", f"{path.stem!r}, as the file, got {plain.get('name')!r}"
        )
    return msgspec.convert({**plain, "folder": str(path.parent)}, RobotFile)


def _check_box(name: str, low_m: Triple, high_m: Triple) -> None:
    if not all(low < high for low, high in zip(low_m, high_m, strict=True)):
        prefix = f"{name}_" if name else ""
        raise ValueError(f"{prefix}low_m: below {prefix}high_m, got {list(low_m)} and {list(high_m)}")
