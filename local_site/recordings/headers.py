"""Headers of columns taken apart: ``plug_pos_x [mm]`` is the role x of the body plug in millimetres."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import NamedTuple

UNITS: dict[str, dict[str, tuple[float, str]]] = {
    "length": {
        **dict.fromkeys(("m", "meter", "meters", "metre", "metres"), (1.0, "m")),
        **dict.fromkeys(("cm", "centimeter", "centimeters", "centimetre", "centimetres"), (1e2, "cm")),
        **dict.fromkeys(("mm", "millimeter", "millimeters", "millimetre", "millimetres"), (1e3, "mm")),
    },
    "angle": {
        **dict.fromkeys(("rad", "rads", "radian", "radians"), (1.0, "rad")),
        **dict.fromkeys(("deg", "degs", "degree", "degrees", "°"), (180.0 / math.pi, "deg")),
    },
    "time": {
        **dict.fromkeys(("s", "sec", "secs", "second", "seconds"), (1.0, "s")),
        **dict.fromkeys(("ms", "msec", "msecs", "millisecond", "milliseconds"), (1e3, "ms")),
        **dict.fromkeys(("us", "µs", "usec", "usecs", "microsecond", "microseconds"), (1e6, "us")),
        **dict.fromkeys(("ns", "nanosecond", "nanoseconds"), (1e9, "ns")),
    },
}
"""Of the units that headers name: how many make one of SI, and their short names. A quotient is rounded once."""
_NANOSECONDS = {"nanosec", "nanosecs", "nsec", "nsecs"}
_TIMES = {"time", "t", "timestamp", "timestamps", "stamp", "elapsed"}
_POSITION = {"position", "pos", "translation", "trans", "location", "loc", "point", "p", "t", "xyz"}
_ROTATION = {"quaternion", "quat", "q", "orientation", "ori", "rotation", "rot", "r", "attitude"}
_ANGLES = {"roll": "roll", "pitch": "pitch", "yaw": "yaw", "theta": "yaw", "heading": "yaw"}
_PAIRS = {f"{c}{axis}": (c, axis) for c in "ptqr" for axis in "xyzw" if c in "qr" or axis != "w"}
_NUMBERS = {
    "frame": "frame",
    "frame_index": "frame",
    "episode": "episode",
    "episode_index": "episode",
    "demo": "episode",
}
# Words that say nothing of what a column is, and words of columns that are no poses.
_FILLING = {"field", "header", "data", "pose", "msg", "obs", "observation", "state", "rigidbody", "transform"}
_OTHER = {
    "vel", "velocity", "speed", "twist", "linear", "angular", "acc", "acceleration", "force", "wrench", "torque", "error",
    "covariance", "std", "gripper", "effort", "joint", "cos", "sin", "reward",
}  # fmt: skip
_KNOWN = (
    set("xyzw") | _NANOSECONDS | _TIMES | _POSITION | _ROTATION | set(_ANGLES) | set(_PAIRS) | _FILLING | _OTHER
    | set().union(*UNITS.values())
)  # fmt: skip


class ColumnLabel(NamedTuple):
    """Meaning of a header: a role of `options.ROLES`, the body, and the unit or an empty string."""

    role: str
    body: str
    unit: str


def label(header: str) -> ColumnLabel | None:
    """Return what a header says, or None for a column that is no part of a pose or time."""
    text, unit = _bracketed_unit(header.replace("Rigid Body", "RigidBody"))
    words = [part for word in re.split(r"[^0-9A-Za-zµ°]+", text) if word for part in _split(word)]
    number = _NUMBERS.get("_".join(words).lower())
    if number or not words:
        return ColumnLabel(number, "", "") if number else None
    if not unit and unit_kind(words[-1]) and (len(words) > 1 or words[-1] in UNITS["time"]):
        unit = words.pop()
    if any(word in _OTHER for word in words):
        return None
    rest = [word for word in words if word not in _FILLING]
    body = "_".join(word for word in rest if word not in _KNOWN and not word.isdigit())
    if not body and (not rest or set(rest) <= _TIMES or set(rest) & _NANOSECONDS):
        return ColumnLabel("nanosec" if set(rest) & _NANOSECONDS else "t", "", unit) if rest or unit else None
    role = _role(rest)
    return ColumnLabel(role, body, unit) if role else None


def _role(words: list[str]) -> str | None:
    """Return the role that the words of a header give it within its body."""
    angles = [_ANGLES[word] for word in words if word in _ANGLES]
    if angles:
        return angles[-1]
    rotates = any(word in _ROTATION for word in words)
    axes = [word for word in words if word in tuple("xyzw")]
    numbers = [word for word in words if word.isdigit()]
    if axes:
        return f"q{axes[-1]}" if rotates else axes[-1] if axes[-1] != "w" else None
    if numbers and rotates:
        return f"q{numbers[-1]}" if numbers[-1] in tuple("0123") else None
    if numbers and any(word in _POSITION for word in words):
        return "xyz"[int(numbers[-1])] if numbers[-1] in tuple("012") else f"p{numbers[-1]}"
    return None


def _split(word: str) -> Sequence[str]:
    """Take a word such as PosX, qx or quat0 apart when each part is known; else it names a body."""
    low = word.lower()
    if low in _PAIRS:
        context, axis = _PAIRS[low]
        return (context, axis) if context != "r" else ("rot", axis)
    if low in _KNOWN or word.isdigit():
        return (low,)
    joined = re.fullmatch(r"([a-z]+?)([xyzw]|\d)", low)
    if joined and joined[1] in _POSITION | _ROTATION:
        return joined[1], joined[2]
    parts = [part.lower() for part in re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])|\d+", word)]
    if len(parts) > 1 and "".join(parts) == low and all(part in _KNOWN for part in parts):
        return parts
    return (word,)


def _bracketed_unit(header: str) -> tuple[str, str]:
    found = re.search(r"[\[(]\s*([A-Za-zµ°]+)\s*[\])]\s*$", header)
    if found and unit_kind(found[1].lower()):
        return header[: found.start()], found[1].lower()
    return header, ""


def unit_kind(word: str) -> str:
    """Return length, angle or time for the name of a unit, or an empty string."""
    return next((kind for kind, names in UNITS.items() if word in names), "")
