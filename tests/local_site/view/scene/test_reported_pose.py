"""Where the tool is in the receptacle, by the robot's report."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from farhand.common.control_mode import ControlMode
from farhand.common.wire.messages import ArmState, Stamp, Telemetry
from farhand.local_site.view.scene.ghost import reported_frame, reported_tip


def test_the_tip_is_seen_from_the_receptacle() -> None:
    turn, origin = Rotation.from_rotvec([0.3, -1.1, 0.4]), np.array([0.8, 0.1, 0.3])
    inside = np.array([0.002, -0.001, 0.085])
    rotation, tip = turn.as_rotvec(), origin + turn.apply(inside)
    report = Telemetry(
        seq=1,
        stamp=Stamp("boot", 0),
        mode=ControlMode.HOLD,
        position_m=tuple(tip.tolist()),
        frame_origin_m=tuple(origin.tolist()),
        frame_rotation_rad=tuple(rotation.tolist()),
        arm=ArmState(tuple(rotation.tolist()), (0.0,) * 6, 10.0, 0),
    )
    np.testing.assert_allclose(reported_tip(report), [*inside, 1.0, 0.0, 0.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(reported_frame(report)[:3], origin)
