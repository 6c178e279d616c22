from __future__ import annotations

import math

import pytest

from farhand.common.mode_table import ControlMode
from farhand.common.wire import keys
from farhand.common.wire.codec import decode
from farhand.common.wire.messages import MoveTarget, OperatorInput, Stamp, Telemetry
from farhand.local_site.console.teleoperation import Teleoperation
from tests.loopback import joined

ROBOT = Telemetry(
    seq=4, stamp=Stamp("boot", 77), mode=ControlMode.DIRECT, position_m=(0.5, 0.5),
    frame_origin_m=(0.7, 0.3), coupling_id=3,
)  # fmt: skip


def test_each_input_echoes_what_was_shown_and_proves_its_right():
    _, link = joined()
    teleoperation = Teleoperation(link)
    teleoperation.hand((0.1, 0.2), False, ROBOT, "lease")
    teleoperation.hand((0.3, 0.2), True, ROBOT, "lease")
    assert [channel for channel, _ in link.sent] == [keys.INPUT] * 2
    first, second = (decode(data, OperatorInput) for _, data in link.sent)
    assert first.seq < second.seq
    assert (first.echo, first.coupling_id, first.lease_id) == (ROBOT.stamp, 3, "lease")
    assert (first.position_m, first.released) == ((0.1, 0.2), False)
    assert (second.position_m, second.released) == ((0.3, 0.2), True)


def test_the_target_is_moved_with_the_lease():
    _, link = joined()
    Teleoperation(link).move_target((0.4, 0.4), None, "lease")
    assert not link.sent
    Teleoperation(link).move_target((0.4, 0.4), ROBOT, "lease")
    ((channel, data),) = link.sent
    assert channel is keys.TARGET
    assert decode(data, MoveTarget) == MoveTarget(echo=ROBOT.stamp, lease_id="lease", position_m=(0.4, 0.4))


def test_a_hand_that_guides_a_pose_sends_its_rotation_too():
    _, link = joined()
    half = math.radians(15.0)
    Teleoperation(link).hand((0.6, 0.1, 0.4, math.cos(half), 0.0, math.sin(half), 0.0), False, ROBOT, "lease")
    message = decode(link.sent[0][1], OperatorInput)
    assert message.position_m == (0.6, 0.1, 0.4)
    assert message.rotation_rad == pytest.approx((0.0, math.radians(30.0), 0.0))
