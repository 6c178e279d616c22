"""User's additions to a recording that does not describe itself: columns, units, task frames."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import Literal

from farhand.common.errors import InvalidConfiguration
from farhand.common.names import check_name

Kind = Literal["auto", "csv", "bag", "lerobot", "robomimic", "lasa", "robotasks", "letters"]

ROLES = (
    "t", "nanosec", "frame", "episode", "x", "y", "z", "qx", "qy", "qz", "qw", "q0", "q1", "q2", "q3",
    "rx", "ry", "rz", "roll", "pitch", "yaw",
)  # fmt: skip
"""Roles of a column: time, position, quaternion, quaternion by number, rotation of three numbers, angles."""
_EULER = frozenset("".join(axes) for text in ("xyz", "XYZ") for axes in itertools.permutations(text))


@dataclass(frozen=True, kw_only=True)
class ImportOptions:
    """Interpretation of a recording; missing options are taken from the recording."""

    kind: Kind = "auto"
    """Format; auto: by the file's name. bag: rosbag2 and MCAP. The research sets lasa (mm), robotasks and letters (cm) must
    be named."""
    columns: tuple[str, ...] = ()
    """Columns by role, ROLE=COLUMN: t=Time x=Pos_X qw=3, by name or number from 1; of another body: socket.x=Pos_X2; none: qw=-.
    t, nanosec, frame, episode; x y z; qx qy qz qw or q0 to q3; roll pitch yaw; rx ry rz."""
    motion: str | None = None
    """Name of the demonstrated body, as in the preview: a group of columns, a topic, a TF frame."""
    frames: tuple[str, ...] = ("goal=last",)
    """Task frames, the goal's last: NAME=last (at the end of the motion, axes of the world), NAME=last-pose (with the
    orientation at the end, too), NAME=BODY (as recorded), NAME=0.6,0,0.4 (by hand, in m; then a quaternion w,x,y,z, or in
    the plane an angle in rad)."""
    quaternion_order: Literal["auto", "xyzw", "wxyz"] = "auto"
    """Order of the columns q0 to q3; auto: that of the format, else an error."""
    rotation: str | None = None
    """Meaning of three numbers of rotation: rotvec, or Euler angles as in scipy: xyz fixed axes, XYZ rotating ones."""
    length_unit: Literal["auto", "m", "cm", "mm"] = "auto"
    """Unit of positions; auto: from the header, else m."""
    angle_unit: Literal["auto", "rad", "deg"] = "auto"
    """Unit of angles; auto: from the header, else an error."""
    time_unit: Literal["auto", "s", "ms", "us", "ns"] = "auto"
    """Unit of times; auto: from the header, else s."""
    delimiter: Literal["auto", "comma", "semicolon", "tab", "bar", "space"] = "auto"
    """Delimiter of the columns in a text file."""
    rate_hz: float | None = None
    """Samples per second [Hz] of a recording without times."""
    tool: tuple[float, ...] = ()
    """Pose of the tool's tip on the tracked body: X Y Z in the body's axes [m], then a quaternion W X Y Z if the axes differ."""
    only: tuple[int, ...] = ()
    """Numbers of the recordings to import, as in the preview; all when not given."""

    def check(self) -> None:
        """Refuse values that fit no recording.

        Raises:
            InvalidConfiguration: Naming the option.
        """
        if self.rate_hz is not None and not (math.isfinite(self.rate_hz) and 2.0 <= self.rate_hz <= 1e5):
            raise wrong("--rate-hz", f"2 to 100000 samples a second, got {self.rate_hz:g}")
        if self.rotation not in (None, "rotvec") and self.rotation not in _EULER:
            raise wrong("--rotation", f"rotvec, or Euler angles such as xyz or ZYX, got {self.rotation!r}")
        if len(self.tool) not in (0, 3, 7) or not all(math.isfinite(number) for number in self.tool):
            raise wrong("--tool", f"three numbers, or seven with the quaternion, got {len(self.tool)}")
        if self.tool and max(map(abs, self.tool[:3])) > 3.0:
            raise wrong("--tool", f"a tip within 3 m of the tracked body, in metres, got {self.tool[:3]}")
        if len(self.tool) == 7:
            _unit(self.tool[3:], "--tool")
        self.chosen_columns()
        self.chosen_frames()

    def chosen_columns(self) -> dict[str, dict[str, str]]:
        """Return the columns by body and role; times belong to the body with the empty name."""
        chosen: dict[str, dict[str, str]] = {}
        for text in self.columns:
            what, _, column = text.partition("=")
            body, _, role = what.rpartition(".")
            if role not in ROLES or not column:
                raise wrong("--columns", f"ROLE=COLUMN with one of {' '.join(ROLES)}, got {text!r}")
            if role in chosen.setdefault(body, {}):
                raise wrong("--columns", f"one column for {what}, got two")
            chosen[body][role] = column
        return chosen

    def chosen_frames(self) -> tuple[FrameChoice, ...]:
        """Return the chosen task frames in their order."""
        frames = tuple(_frame(text) for text in self.frames)
        names = [frame.name for frame in frames]
        if not frames or len(set(names)) < len(names):
            raise wrong(
                "--frames", f"one task frame or more, each with its own name, got {' '.join(self.frames)!r}"
            )
        return frames


@dataclass(frozen=True)
class FrameChoice:
    """Task frame as chosen by the user.

    Args:
        name: Name of the frame.
        source: ``last``, ``last-pose``, or the name of a body; empty for a frame given by numbers.
        numbers: Origin [m], then an angle [rad] or a quaternion w, x, y, z.
    """

    name: str
    source: str
    numbers: tuple[float, ...] = ()


def _frame(text: str) -> FrameChoice:
    name, _, source = text.partition("=")
    if not name or not source:
        raise wrong("--frames", f"NAME=last, NAME=last-pose, NAME=BODY or NAME=X,Y,Z, got {text!r}")
    check_name(name, "--frames")  # a task could not name another one
    parts = source.split(",")
    try:
        numbers = tuple(float(part) for part in parts)
    except ValueError:
        return FrameChoice(name, source)
    if len(numbers) not in (2, 3, 7) or not all(math.isfinite(number) for number in numbers):
        raise wrong(
            "--frames", f"X,Y or X,Y,ANGLE in the plane, X,Y,Z or X,Y,Z,W,X,Y,Z in space, got {text!r}"
        )
    if len(numbers) == 7:
        _unit(numbers[3:], "--frames")
    return FrameChoice(name, "", numbers)


def _unit(quaternion: tuple[float, ...], option: str) -> None:
    if abs(math.hypot(*quaternion) - 1.0) > 1e-2:
        expected = f"a quaternion w, x, y, z of length 1, got length {math.hypot(*quaternion):g}"
        raise wrong(option, expected)


def wrong(option: str, expected: str) -> InvalidConfiguration:
    """Return the error for an option that does not fit."""
    return InvalidConfiguration("command line", option, expected)
