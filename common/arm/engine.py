"""The only import of MuJoCo, dm_control, mink and daqp, in the one order that works.

MUJOCO_GL is read once, at the first import, and dm_control then fails when that OpenGL is not installed. Physics
needs none, so both are told to load none, and `rendering` opens its own context when it has something to draw. Their
bindings carry no types: everything exported here is `Any`.
"""

# ruff: noqa: E402

from __future__ import annotations

import os
from typing import Any, TypeAlias

WANTED_GL = os.environ.get("MUJOCO_GL", "")
"""The user's choice of OpenGL for drawing, empty for none."""

os.environ["MUJOCO_GL"] = "disable"

import daqp as _daqp
import mink as _mink
import mujoco as _mujoco
from dm_control import mjcf as _mjcf
from dm_control.entities.manipulators import kinova as _kinova

daqp: Any = _daqp
mink: Any = _mink
mujoco: Any = _mujoco
mjcf: Any = _mjcf
kinova: Any = _kinova

MjModel: TypeAlias = Any
MjSpec: TypeAlias = Any
MjData: TypeAlias = Any
MjcfElement: TypeAlias = Any
