"""Options of the two drivers, as the tables `[arm_driver]` and `[perception]` of the robot site's file have them."""

from __future__ import annotations

from typing import Annotated, Any, Literal, TypeVar

import numpy as np
from msgspec import Meta, Struct, convert
from numpy.typing import NDArray

Positive = Annotated[float, Meta(gt=0)]
Reliability = Literal["best_effort", "reliable"]
Domain = Annotated[int, Meta(ge=0, le=232)]


class Pose(Struct, frozen=True, forbid_unknown_fields=True):
    """Pose of one frame in another."""

    pos_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    quat_wxyz: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)

    @property
    def position_m(self) -> NDArray[np.float64]:
        """Origin. Shape (3,) [m]."""
        return np.array(self.pos_m)

    @property
    def axes(self) -> NDArray[np.float64]:
        """Axes, as the columns of a rotation. Shape (3, 3).

        Raises:
            ValueError: When the quaternion has no direction.
        """
        return rotation(np.array(self.quat_wxyz))


class NodeOptions(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Options of a ROS 2 node."""

    domain_id: Domain | None = None
    """ROS domain; `ROS_DOMAIN_ID` of the environment when not given."""
    reliability: Reliability = "best_effort"
    """Reliability of the subscriptions; best_effort also hears reliable publishers."""


class ArmOptions(NodeOptions, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Options of the arm."""

    joint_states: str = "/joint_states"
    """Topic of `sensor_msgs/JointState`, with positions and velocities."""
    wrench: str = "/force_torque_sensor_broadcaster/wrench"
    """Topic of `geometry_msgs/WrenchStamped`."""
    commands: str = "/forward_velocity_controller/commands"
    """Topic of `std_msgs/Float64MultiArray`, to which the velocity controller listens."""
    joints: tuple[str, ...] = ()
    """Names of the joints in ROS, in the order of the robot's file; the names of that file when not given."""
    command_joints: tuple[str, ...] = ()
    """The same names in the order of the controller's parameter `joints`, if it is another one."""
    sensor: Pose = Pose()
    """Pose of the sensor's frame in the wrist's: origin at the wrist, z to the tip."""
    sensor_measures: Literal["on tool", "on arm"] = "on tool"
    """Body on which the measured force acts; a sensor that tells the tool's action on the arm has the opposite sign."""
    silent_s: Positive = 0.1
    """Silence of a topic after which it is a fault [s]."""
    valid_s: Positive = 0.1
    """Time for which a command is valid; then the velocities are zero [s]."""
    start_s: Positive = 10.0
    """Longest wait for the robot at the start [s]."""


class TrackerOptions(NodeOptions, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Options of the tracker."""

    poses: tuple[str, ...] = ("/receptacle/pose",)
    """Topics of `geometry_msgs/PoseStamped`: one for each frame of the task, in the order of its `frame_names`."""
    tf_frames: tuple[str, ...] = ()
    """Frames of TF in place of `poses`, in the same order."""
    frame_id: str = ""
    """Frame in which the poses must be told; any one when not given. The frame in which TF's are looked up, `base_link` for
    example."""
    frame: Pose = Pose()
    """Pose of that frame in the robot file's world, in which the arm's base stands at `base`."""
    noise_m: Positive = 0.001
    """Standard deviation of a measured position per axis [m]."""
    noise_rad: Positive = 0.005
    """Standard deviation of a measured orientation per axis [rad]."""


T = TypeVar("T", bound=NodeOptions)


def read_options(kind: type[T], options: dict[str, Any]) -> T:
    """Return the options of a driver.

    Raises:
        msgspec.ValidationError: When a field is unknown or wrong; names it.
    """
    return convert(options, type=kind)


def rotation(quat_wxyz: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the rotation of a quaternion, which need not be of unit length. Shapes (4,) and (3, 3).

    Raises:
        ValueError: When it is not finite, or too short to have a direction.
    """
    length = float(np.linalg.norm(quat_wxyz))
    if not 1e-3 < length < np.inf:
        raise ValueError(f"a quaternion of length 1, got {quat_wxyz.tolist()}")
    w, x, y, z = quat_wxyz / length
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
