"""The robot's camera on the page: the picture says how old it is, and no picture says why."""

from __future__ import annotations

from dataclasses import replace

import pytest

from farhand.common.mode_table import ControlMode
from farhand.common.wire.messages import CameraPicture, Stamp, Telemetry
from farhand.common.wire.reasons import Code, because
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.exchange.camera import CameraState
from farhand.local_site.exchange.report_age import LinkHealth, LinkView
from farhand.local_site.view.panels.camera_panel import SteadyAge, _over, _picture, is_old, picture_age_s

ROBOT = Telemetry(
    seq=1, stamp=Stamp("boot", 10_000_000_000), mode=ControlMode.HOLD, position_m=(0.5, 0.0, 0.4),
    frame_origin_m=(0.8, 0.0, 0.4),
)  # fmt: skip
GOOD, LOST = (
    LinkView(LinkHealth.OK, 0.02, 0.6, 0.32, 100, 0),
    LinkView(LinkHealth.LOST, 9.7, 0.6, 10.0, 100, 0),
)


def picture(t_s: float = 9.8, boot: str = "boot") -> CameraPicture:
    return CameraPicture(
        seq=1, stamp=Stamp(boot, round(1e9 * t_s)), width_px=320, height_px=240, jpeg=b"\xff\xd8\xff"
    )


def seen(base: ConsoleState, camera: CameraState, link: LinkView = GOOD) -> ConsoleState:
    return replace(base, now_s=100.0, robot=ROBOT, link=link, camera=camera)


def shown(taken: CameraPicture | None, **changes: object) -> CameraState:
    return CameraState(wanted=True, picture=taken, is_there=True, interval_s=0.33, **changes)  # type: ignore[arg-type]


def test_the_age_is_that_of_the_exposure_by_the_robots_clock(nothing_yet: ConsoleState):
    state = seen(nothing_yet, shown(picture()))
    assert picture_age_s(state, 100.0) == pytest.approx(0.32 + 0.2)
    assert picture_age_s(state, 100.5) == pytest.approx(1.02)
    assert "camera" in _over(state, 0.52, False, "") and "0.5 s ago" in _over(state, 0.52, False, "")


def test_a_picture_of_an_earlier_boot_has_no_age_and_is_not_shown(nothing_yet: ConsoleState):
    state = seen(nothing_yet, shown(picture(boot="earlier")))
    assert picture_age_s(state, 100.0) is None
    assert "waiting for a picture" in _over(state, None, True, "") and "svg" not in _over(
        state, None, True, ""
    )


def test_an_old_picture_is_grey_and_says_so(nothing_yet: ConsoleState):
    fresh = seen(nothing_yet, shown(picture()))
    assert not is_old(fresh, 0.9) and is_old(fresh, 2.0)
    assert not is_old(replace(fresh, camera=replace(fresh.camera, interval_s=2.0)), 4.5), "one each 2 s"
    assert is_old(seen(nothing_yet, shown(picture()), LOST), 0.1)
    assert "fh-camera-old" in _picture(picture(), True) and "fh-camera-old" not in _picture(picture(), False)
    assert "OLD: 12 s ago" in _over(fresh, 12.3, True, "")


def test_the_reason_for_no_picture_is_told_also_over_the_last_one(nothing_yet: ConsoleState):
    narrow = because(Code.LINK_NARROW, rate_kbps=9.6, least_kbps=30.0)
    assert "no picture: the link carries 9.6 kbit/s, pictures need 30" in _over(
        seen(nothing_yet, shown(None, why=narrow)), None, True, ""
    )
    failed = seen(nothing_yet, shown(picture(), why=because(Code.CAMERA_FAILED, text="<b>unplugged</b>")))
    assert "no picture: &lt;b&gt;unplugged&lt;/b&gt;" in _over(failed, 3.0, True, "")


def test_the_told_age_does_not_flicker_and_is_never_that_of_an_old_picture_beside_a_new_one():
    age = SteadyAge()
    told = [age.told(*each) for each in ((0.5, False, 0.0), (0.8, False, 0.5), (0.5, False, 1.0))]
    assert told == [0.5, 0.8, 0.8]
    assert age.told(0.5, False, 3.0) == 0.5
    assert age.told(12.4, True, 3.1) == 12.4
    assert age.told(0.6, False, 3.2) == 0.6
    assert age.told(None, True, 3.3) is None
