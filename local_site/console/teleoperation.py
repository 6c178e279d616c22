"""Direct teleoperation, the operator's half: the hand's movement on its way to the robot."""

from __future__ import annotations

from farhand.common.link.link import Link
from farhand.common.model.manifold import POSE
from farhand.common.wire import keys
from farhand.common.wire.codec import encode
from farhand.common.wire.messages import MoveTarget, OperatorInput, Telemetry

_UPRIGHT = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)


class Teleoperation:
    """Sends the hand's position while coupled, and nothing otherwise.

    Args:
        link: To the robot.
    """

    def __init__(self, link: Link):
        self._link = link
        self._seq = 0

    def hand(self, point: tuple[float, ...], released: bool, robot: Telemetry, lease_id: str) -> None:
        """Send where the hand is.

        Args:
            point: A position [m], or a pose. Length C.
            released: The hand let go: the coupling ends.
            robot: The report that the operator sees; it must be coupled.
            lease_id: Proof of control.
        """
        self._seq += 1
        turned = len(point) == POSE.n_coordinates
        message = OperatorInput(
            seq=self._seq,
            echo=robot.stamp,
            lease_id=lease_id,
            coupling_id=robot.coupling_id,
            position_m=point[: POSE.n_dims] if turned else point,
            rotation_rad=_rotation_rad(point) if turned else (),
            released=released,
        )
        self._link.send(keys.INPUT, encode(message))

    def move_target(self, position_m: tuple[float, ...], robot: Telemetry | None, lease_id: str) -> None:
        """Have the robot's simulated target move; without control of the robot it stays where it is.

        Args:
            position_m: Where its mean is to be. Length D [m].
            robot: The report that the operator sees; before the first one nothing is sent.
            lease_id: Proof of control.
        """
        if robot is not None:
            message = MoveTarget(echo=robot.stamp, lease_id=lease_id, position_m=position_m)
            self._link.send(keys.TARGET, encode(message))


def _rotation_rad(pose: tuple[float, ...]) -> tuple[float, ...]:
    """The orientation of a pose as a rotation vector [rad]."""
    return tuple(POSE.log(_UPRIGHT, POSE.checked(pose, "hand", "point"))[POSE.n_dims :].tolist())
