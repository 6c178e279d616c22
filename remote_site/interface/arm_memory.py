"""Stored state of a simulated arm, so that its next boot finds it, and its surroundings, where they were."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta, Struct

Joints = Annotated[tuple[float, ...], Meta(min_length=6, max_length=6)]
Pose = Annotated[tuple[float, ...], Meta(min_length=7, max_length=7)]


class ArmMemory(Struct, frozen=True, forbid_unknown_fields=True):
    """Arm in front of its receptacle.

    Args:
        joints_rad: Joint angles [rad].
        receptacle: Resting pose of the receptacle.
        time_s: Time for which the disturbances have gone on; they continue from there [s].
        tare: Zero of the wrist's sensor [N, Nm]; a plug in the bore prevents a new tare.
    """

    joints_rad: Joints
    receptacle: Pose
    time_s: float
    tare: Joints
