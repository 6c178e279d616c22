"""Direct teleoperation, the operator's part: the hand's movement is sent to the robot."""

from __future__ import annotations

from farhand.common.link.interface import Link
from farhand.common.model.manifold import POSE
from farhand.common.wire import keys
from farhand.common.wire.codec import encode
from farhand.common.wire.messages import MoveTarget, OperatorInput, Telemetry

_UPRIGHT = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)


class Teleoperation:
    """Sender of the hand's position while coupled.

    Args:
        link: To the robot.
    """

    def __init__(self, link: Link):
        self._link = link
        self._seq = 0
        self._drag = 0
        """Coupling in which the present drag moved the robot; 0 for none."""

    def goes_on(self, coupling: int, released: bool) -> bool:
        """Decide whether a drag may continue: one that drove the robot must never move anything else.

        Args:
            coupling: Present coupling, 0 for none.
            released: True when the hand let go: the next movement begins another drag.
        """
        began = self._drag or coupling
        self._drag = 0 if released else began
        return began == coupling

    def end_drag(self) -> None:
        """End the drag, because the operator gives a command."""
        self._drag = 0

    def hand(self, point: tuple[float, ...], released: bool, robot: Telemetry, lease_id: str) -> None:
        """Send the hand's point.

        Args:
            point: Position [m], or pose. Length C.
            released: True when the hand let go: the coupling ends.
            robot: Report that the operator sees; it must be coupled.
            lease_id: Id of the lease, the proof of control.
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
        """Move the robot's simulated target; without control of the robot the target stays where it is.

        Args:
            position_m: New mean position of the target. Length D [m].
            robot: The report that the operator sees; None before the first, when nothing is sent.
            lease_id: Id of the lease, the proof of control.
        """
        if robot is not None:
            message = MoveTarget(echo=robot.stamp, lease_id=lease_id, position_m=position_m)
            self._link.send(keys.TARGET, encode(message))


def _rotation_rad(pose: tuple[float, ...]) -> tuple[float, ...]:
    """Return the orientation of a pose as a rotation vector [rad]."""
    return tuple(POSE.log(_UPRIGHT, POSE.checked(pose, "hand", "point"))[POSE.n_dims :].tolist())
