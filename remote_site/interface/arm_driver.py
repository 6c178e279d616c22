"""Driver of an arm: joint velocities go in, joint angles and the wrist's wrench come out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from farhand.common.errors import InvalidInput
from farhand.remote_site.interface.plant import are_plausible

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ArmReading:
    """Measured state of an arm, its joints in the order of the robot's file.

    Args:
        joints_rad: Joint angles. Shape (N,) [rad].
        joint_velocities: Joint velocities. Shape (N,) [rad/s].
        wrench: Force and torque on the tool about the wrist, in the axes of the tool, its weight included, mean over the
            last 10 ms. Shape (6,) [N, Nm].
    """

    joints_rad: Array
    joint_velocities: Array
    wrench: Array


def check_reading(reading: ArmReading, n_joints: int) -> None:
    """Check what an arm's driver returned; what is implausible must not enter any estimate.

    Args:
        reading: State of the arm.
        n_joints: Number N of joints.

    Raises:
        InvalidInput: When it is no `ArmReading`, a vector has another shape, or a number is not finite or
            beyond a million.
    """
    if not isinstance(reading, ArmReading):
        raise InvalidInput("arm driver", "read", f"an ArmReading, got {type(reading).__name__}")
    for name, n in (("joints_rad", n_joints), ("joint_velocities", n_joints), ("wrench", 6)):
        vector = getattr(reading, name)
        if getattr(vector, "shape", None) != (n,):
            found = f"shape {vector.shape}" if isinstance(vector, np.ndarray) else type(vector).__name__
            raise InvalidInput("arm driver", f"read: {name}", f"an array of shape ({n},), got {found}")
        if not are_plausible(vector):
            raise InvalidInput(
                "arm driver", f"read: {name}", "finite numbers only, and none beyond a million"
            )


class ArmDriver(Protocol):
    """Interface of an arm's machine; your own arm needs one class with these two methods.

    Farhand does the rest: inverse kinematics, compliance, limits. What it may have besides: `Startable`, `Closable`,
    `Haltable`, `Monitored`. It should hold its last command for 0.1 s at most: then the process has ended.
    """

    def read(self) -> ArmReading:
        """Measure and return the arm's state."""
        ...

    def command(self, joint_velocities: Array, dt_s: float) -> None:
        """Move with these joint velocities for one control period, within the limits of the robot's file.

        Args:
            joint_velocities: Shape (N,) [rad/s].
            dt_s: Control period [s].
        """
        ...
