"""The job by mouse: teach, undo, send, drive, clutch, preview, execute, arrive."""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import expect

from farhand.local_site.teaching.demonstration import Demonstration
from farhand.local_site.view.scene.board.boards import view_of
from tests.browser.board_picture import await_point, seen_point
from tests.browser.operator_page import BOARD_M, WAIT_MS, OperatorPage, Points
from tests.browser.stack import Stack

START, U = (0.15, 0.75), (0.72, 0.25)


def arc(start: tuple[float, float], via: tuple[float, float], n: int = 14) -> Points:
    """A curve from a start into the U."""
    s = np.linspace(0.0, 1.0, n)[:, None]
    points = (1 - s) ** 2 * start + 2 * s * (1 - s) * np.array(via) + s**2 * np.array(U)
    return [(float(x), float(y)) for x, y in points]


STROKES = [
    arc((0.12, 0.78), (0.62, 0.72)),
    arc((0.50, 0.92), (0.68, 0.75)),
    arc((0.14, 0.30), (0.50, 0.75)),
]


def teach(tab: OperatorPage, stroke: Points) -> None:
    demos = tab.number("demos")
    tab.press("Record")
    tab.says("recording", "RECORDING")
    draw_until_learned(tab, stroke)
    tab.press("End")
    tab.says("demos", f"{demos + 1:.0f}")
    tab.says("recording", "")


def draw_until_learned(tab: OperatorPage, stroke: Points) -> None:
    """Drag along the stroke; once more where the browser, busy drawing, took it for a move without a button."""
    learned = re.compile("^[1-9]")
    for _ in range(3):
        with tab.hold(stroke), suppress(AssertionError):
            expect(tab.tp("components")).to_have_text(learned, timeout=WAIT_MS / 4)
            return
    raise AssertionError("the page learned nothing from three drags")


def demonstrations(stack: Stack) -> list[Path]:
    return sorted(stack.model_file.parent.glob("demonstration-*.npz"))


def test_strokes_teach_as_they_are_drawn_and_undo_restores_the_model_bit_for_bit(
    tab: OperatorPage, stack: Stack
) -> None:
    teach(tab, STROKES[0])
    teach(tab, STROKES[1])
    before = stack.model_file.read_bytes()
    components = tab.number("components")
    teach(tab, STROKES[2])
    assert stack.model_file.read_bytes() != before
    tab.press("Undo")
    tab.says("demos", "2")
    tab.tells("the last demonstration was undone")
    assert stack.model_file.read_bytes() == before
    tab.says("components", f"{components:.0f}")


def test_what_is_learned_is_what_was_drawn(tab: OperatorPage, stack: Stack) -> None:
    known = set(demonstrations(stack))
    teach(tab, STROKES[2])
    (file,) = set(demonstrations(stack)) - known
    drawn = np.array(STROKES[2])
    learned = Demonstration.load(file)
    box = tab.canvas.bounding_box()
    assert box is not None
    pixel_m = 1.0 / view_of(BOARD_M, (box["width"], box["height"])).pixels_per_m
    assert distance_to(drawn, learned.position_m).max() < 2.0 * pixel_m
    # The browser's own pace leaves no trace: the hand moves evenly, at the learner's rate.
    np.testing.assert_allclose(np.diff(learned.time_s), np.diff(learned.time_s)[0], rtol=1e-6)
    speed = np.linalg.norm(np.diff(learned.position_m, axis=0), axis=1) / np.diff(learned.time_s)
    assert np.ptp(speed[1:-1]) < 0.2 * np.median(speed)


def test_the_mouse_drives_the_robot_only_while_coupled(tab: OperatorPage) -> None:
    tab.command("Arm", "HOLD")
    await_point(tab, START)
    tab.draw([(0.3, 0.3), (0.4, 0.4), (0.5, 0.4)])
    tab.tells("nothing follows your hand now")
    begin = await_point(tab, START, within_m=0.01)
    for _ in range(4):  # a browser that is busy drawing may take longer than the robot waits for a hand
        tab.command("Couple", "DIRECT")
        tab.says("holder", "OPERATOR")
        with tab.hold([(0.1, 0.3), (0.12, 0.3)]), suppress(NotFollowed):
            drive_right_until(tab, begin[0] + 0.05)
            break
    else:
        raise NotFollowed
    tab.says("mode", "HOLD")
    tab.tells("the drag ended")
    tab.command("Couple", "DIRECT")
    tab.command("Clutch", "HOLD")
    tab.says("holder", "NOBODY")


_PAD = """(held) => { navigator.getGamepads = () => [{ connected: true, axes: [held ? 1 : 0, 0, 0, 0],
  buttons: [0, 1, 2, 3, 4, 5].map((n) => ({ pressed: n === 5 && held, value: 0 })) }] }"""


def _pad(tab: OperatorPage, held: bool) -> None:
    tab.page.evaluate(_PAD, held)


def _key(tab: OperatorPage, held: bool) -> None:
    (tab.page.keyboard.down if held else tab.page.keyboard.up)("l")


@pytest.mark.parametrize("hold", [_pad, _key])
def test_a_gamepad_or_a_key_drives_the_robot_only_while_it_is_held(
    tab: OperatorPage, hold: Callable[[OperatorPage, bool], None]
) -> None:
    tab.command("Arm", "HOLD")
    _pad(tab, False)  # it counts once it was seen with its dead-man button up
    expect(tab.page.locator("body[data-pad]")).to_be_attached(timeout=WAIT_MS)
    for _ in range(4):  # as above: a busy browser may be slower than the robot waits
        tab.command("Couple", "DIRECT")
        begin = seen_point(tab) or START
        hold(tab, True)
        try:
            _await_right_of(tab, begin[0] + 0.05)
            break
        except NotFollowed:
            tab.says("mode", "HOLD")
        finally:
            hold(tab, False)
    else:
        raise NotFollowed
    tab.says("mode", "HOLD")


def _await_right_of(tab: OperatorPage, x_m: float) -> None:
    """Wait until the robot's point is seen there, or the robot has ended the coupling for want of a hand."""
    give_up_s = time.monotonic() + WAIT_MS / 1e3
    while time.monotonic() < give_up_s:
        seen = seen_point(tab)
        if seen is not None and seen[0] > x_m:
            return
        if tab.tp("mode").inner_text() != "DIRECT":
            break
        tab.frames(2)
    raise NotFollowed


def test_what_the_robot_is_driven_through_while_it_records_becomes_a_demonstration(tab: OperatorPage) -> None:
    tab.command("Arm", "HOLD")
    n = 0
    for _ in range(4):  # as above: a busy browser may be slower than the robot waits
        tab.command("Couple", "DIRECT")
        n = int(tab.number("demos"))
        tab.press("Record")
        tab.says("robot-recording", re.compile(r"recording on the robot \d+ s"))
        begin = seen_point(tab)
        assert begin is not None
        with tab.hold([(0.1, 0.3), (0.12, 0.3)]), suppress(NotFollowed):
            drive_right_until(tab, begin[0] + 0.05)
            break
        tab.says("mode", "HOLD")
        tab.says("robot-recording", "")
    else:
        raise NotFollowed
    tab.says("demos", str(n + 1))
    tab.tells("learned the robot's recording")
    tab.says("robot-recording", "")
    tab.press("Undo")
    tab.says("demos", str(n))


def test_the_robot_executes_what_was_taught_and_arrives_in_the_u(tab: OperatorPage) -> None:
    tab.not_offered("Execute")
    tab.taught()
    tab.command("Arm", "HOLD")
    tab.press("Preview")
    tab.tells(re.compile("previewed .* s of motion"))
    tab.command("Execute", "AUTONOMOUS")
    tab.says("holder", "REMOTE MPC")
    tab.says("phase", "ARRIVED")
    await_point(tab, U)
    active = int(tab.tp("graph").get_attribute("data-active") or -1)
    assert 0 <= active < tab.number("components")
    tab.page.get_by_role("tab", name="Executions").click()
    expect(tab.tp("outcome").first).to_have_text("arrived", timeout=WAIT_MS)
    expect(tab.tp("outcome").first).to_be_visible()
    tab.says("executions-count", re.compile(r"^(\d+) of \d+ ended as they should$"))
    tab.command("Clutch", "HOLD")


def test_the_robots_u_can_be_dragged_and_the_robot_follows_it(tab: OperatorPage) -> None:
    tab.taught()
    tab.command("Arm", "HOLD")
    tab.command("Execute", "AUTONOMOUS")
    tab.says("phase", "ARRIVED")
    tab.draw([U, (0.65, 0.30), (0.60, 0.35), (0.55, 0.40)], remote=True)
    await_point(tab, (0.55, 0.40))
    tab.draw([(0.55, 0.40), (0.60, 0.35), (0.65, 0.30), U], remote=True)
    await_point(tab, U)


class NotFollowed(AssertionError):
    """The robot did not follow the hand."""


def drive_right_until(tab: OperatorPage, x_m: float) -> None:
    """Move the hand to the right until the robot's point is seen beyond x.

    In bursts: whenever the hand rests for half a second, the robot takes its next move as a new beginning.
    """
    for burst in range(7):
        for step in range(1, 11):
            tab.page.mouse.move(*tab.pixel((0.12 + 0.1 * burst + 0.01 * step, 0.3)))
        seen = seen_point(tab)
        if seen is not None and seen[0] > x_m:
            return
    raise NotFollowed


def distance_to(polyline: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Distance of each point to a polyline."""
    a, ab = polyline[:-1], np.diff(polyline, axis=0)
    part = np.clip(((points[:, None] - a) * ab).sum(-1) / (ab**2).sum(-1), 0.0, 1.0)
    return np.linalg.norm(points[:, None] - (a + part[..., None] * ab), axis=-1).min(axis=1)


def test_the_speed_slider_shows_what_the_robot_reported(tab: OperatorPage) -> None:
    tab.command("Arm", "HOLD")
    tab.slide("Speed [%]", 50)
    tab.says("pace", "at 50%")
    tab.page.reload()
    tab.settle()
    tab.says("pace", "at 50%")
    expect(tab.slider("Speed [%]")).to_have_value("50", timeout=WAIT_MS)
    tab.slide("Speed [%]", 100)
    tab.says("pace", "")
