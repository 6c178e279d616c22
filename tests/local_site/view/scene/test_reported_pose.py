"""Where the tool is in the receptacle, by the robot's report."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from farhand.common.mode_table import ControlMode
from farhand.common.wire.messages import ArmState, PlannedPath, Stamp, Telemetry
from farhand.common.wire.motion_encoding import packed
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.view.scene.ghost import reported_frame, reported_tip, shown_points


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


def test_a11_a_preview_begins_where_the_robot_stands_though_its_target_has_moved(
    nothing_yet: ConsoleState,
) -> None:
    points = np.linspace([-0.5, 0.3], [0.0, 0.0], 20)
    path = PlannedPath(
        stamp=Stamp("boot", 1), path_id=1, plan_id=3, model_sha256="a" * 64, step_s=0.1, reaches_end=True,
        n_coordinates=2, points=packed(points),
    )  # fmt: skip
    for origin in ((0.7, 0.3), (0.75, 0.28)):
        robot = Telemetry(
            seq=1, stamp=Stamp("boot", 1), mode=ControlMode.HOLD, position_m=(0.2, 0.6), frame_origin_m=origin
        )  # fmt: skip
        shown = shown_points(replace(nothing_yet, robot=robot, path=path, plan_id=3))
        assert shown is not None
        np.testing.assert_allclose(shown[0] + origin, (0.2, 0.6), atol=1e-6)
        np.testing.assert_allclose(shown[-1], points[-1], atol=1e-3)
