"""What is remembered of a simulated arm, so that its next boot finds it, and its surroundings, where they were."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta, Struct

Joints = Annotated[tuple[float, ...], Meta(min_length=6, max_length=6)]
Pose = Annotated[tuple[float, ...], Meta(min_length=7, max_length=7)]


class ArmMemory(Struct, frozen=True, forbid_unknown_fields=True):
    """An arm before its receptacle.

    Args:
        joints_rad: Its angles [rad].
        receptacle: Where the receptacle rests.
        time_s: How long it has been disturbed; the disturbances go on from there [s].
        tare: What its wrist's sensor measures when nothing is touched [N, Nm]: in the bore it cannot be found out.
    """

    joints_rad: Joints
    receptacle: Pose
    time_s: float
    tare: Joints
