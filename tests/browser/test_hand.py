"""The operator's hand on the arm's page: keys, a gamepad, the gauge, the view from behind; the robot is played."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from playwright.sync_api import Browser, expect

from farhand.common.arm.simulation.description import describe
from farhand.deploy.places import find_task, sample_files
from farhand.local_site.console import intents
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.view.page import Page
from farhand.local_site.view.page_access import PageAccess
from farhand.local_site.workcell.arm_drivers import LiveArm
from farhand.local_site.workcell.hand_motion import hand_axes
from tests.browser.arm_page import ArmPage
from tests.browser.operator_page import WAIT_MS
from tests.browser.test_layout import SIZES, SMALL_SIZES, assert_accessible, assert_legible, drawer_open
from tests.cells import JACO
from tests.local_site.robot_end import HOT_STAB, Desk, desk

Array = NDArray[np.float64]

# In software an arm is drawn slowly.
pytestmark = [pytest.mark.soak, pytest.mark.timeout(400)]

_PAD = """() => { window.pad = null; navigator.getGamepads = () => [window.pad]; }"""
_SET_HIDDEN = """(hidden) => { Object.defineProperty(document, "hidden", { configurable: true, get: () => hidden });
  document.dispatchEvent(new Event("visibilitychange")) }"""
_SET_PAD = """([held, axes]) => { window.pad = {
  connected: true, axes, buttons: [0, 1, 2, 3, 4, 5].map((n) => ({ pressed: n === 5 && held, value: 0 })) } }"""


class Teaching:
    """The page in a browser, and the console behind it."""

    def __init__(self, it: Desk, place: LiveArm, page: Page, tab: ArmPage):
        self.it, self.place, self.server, self.tab = it, place, page, tab

    def until(self, holds: Callable[[ConsoleState], bool]) -> ConsoleState:
        assert self.it.console.wait_for(holds, WAIT_MS / 1000.0)
        return self.it.picture

    @property
    def tip(self) -> Array:
        arm = self.it.picture.own_arm
        assert arm is not None
        return arm.tip

    @property
    def axes(self) -> Array:
        """To the right, up, and in. Shape (3, 3)."""
        arm = self.it.picture.own_arm
        assert arm is not None
        return hand_axes(arm.receptacle)

    def camera(self) -> Array:
        """Where the camera is and looks to, as the browser said last. Shape (6,)."""
        (client,) = self.server._server.get_clients().values()
        return np.concatenate([client.camera.position, client.camera.look_at])

    def rest(self) -> Array:
        """Wait until the arm has stood for a second and nothing holds it; return its tip."""
        self.until(lambda _: self.place.asleep)
        return self.tip

    def after_step(self, key: str) -> Array:
        """Press a key; return the step of the tip, in the axes, in millimetres."""
        before = self.rest()
        self.tab.page.keyboard.press(key)
        self.until(lambda p: p.own_arm is not None and p.own_arm.held)
        return 1e3 * self.axes.T @ (self.rest() - before)[:3]

    def drag_beside_the_arrows(self) -> None:
        """Drag with the left button over a place of the canvas where nothing is."""
        box, mouse = self.tab.canvas.bounding_box(), self.tab.page.mouse
        assert box is not None
        x, y = box["x"] + 0.85 * box["width"], box["y"] + 0.3 * box["height"]
        mouse.move(x, y)
        self.tab.frames(2)
        mouse.down()
        for step in range(1, 9):
            mouse.move(x - 15.0 * step, y + 5.0 * step)
            self.tab.next_frame()
        mouse.up()
        self.tab.frames(4)

    def pad(self, held: bool, *axes: float) -> None:
        """Say what the gamepad does."""
        self.tab.page.evaluate(_SET_PAD, [held, list(axes)])


@contextmanager
def teaching(browser: Browser, data_dir: Path) -> Iterator[Teaching]:
    tasks = HOT_STAB, find_task("hot-stab-removal")
    place = LiveArm(HOT_STAB, JACO, sample_files)
    with desk(data_dir, *tasks, place=place) as it:
        page = Page(it.console, HOT_STAB, None, PageAccess(), 0, describe(JACO))
        page.start()
        context = browser.new_context(viewport={"width": 900, "height": 560})
        context.add_init_script(f"({_PAD})()")
        try:
            it.connected()
            tab = ArmPage(context.new_page())
            tab.goto(page.address)
            expect(tab.canvas).to_be_visible(timeout=WAIT_MS)
            yield Teaching(it, place, page, tab)
            assert tab.problems == []
        finally:
            context.close()
            page.close()


@pytest.fixture(scope="module")
def taught(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Teaching]:
    with teaching(browser, tmp_path_factory.mktemp("hand")) as it:
        yield it


@pytest.fixture
def recording(taught: Teaching) -> Iterator[Teaching]:
    """While a demonstration is recorded, from a new place."""
    console = taught.it.console
    console.submit(intents.ResetArm(seed=0))
    console.submit(intents.RecordDemonstration())
    taught.tab.says("recording", "RECORDING")
    taught.rest()
    yield taught
    if taught.it.picture.recording:
        console.submit(intents.Undo())
        taught.tab.says("recording", "")


def test_the_view_is_from_behind_while_recording_and_the_left_button_does_not_turn_it(taught: Teaching):
    tab, first = taught.tab, taught.camera()
    taught.drag_beside_the_arrows()
    assert np.linalg.norm(taught.camera() - first) > 0.1, "otherwise the drag turns the camera"
    turned = taught.camera()
    tab.insist("Record", "recording", "RECORDING")
    tab.frames(10)
    behind = taught.camera()
    assert np.linalg.norm(behind - turned) > 0.1
    taught.drag_beside_the_arrows()
    taught.after_step("j")  # what the browser sent before this has arrived
    np.testing.assert_allclose(taught.camera(), behind, atol=1e-3)
    tab.insist("Undo", "recording", "")
    tab.frames(10)
    np.testing.assert_allclose(taught.camera(), turned, atol=1e-3)


def test_a_key_is_a_step_along_the_receptacles_axes_and_not_while_one_types(recording: Teaching):
    np.testing.assert_allclose(recording.after_step("l"), [5.0, 0.0, 0.0], atol=0.7)
    np.testing.assert_allclose(recording.after_step("Shift+u"), [0.0, 1.0, 0.0], atol=0.5)
    before, page = recording.rest(), recording.tab.page
    page.get_by_role("combobox", name="Task").focus()
    page.keyboard.press("l")
    page.locator("#fh-menu").focus()
    np.testing.assert_allclose(
        recording.after_step("k"), [0.0, 0.0, -5.0], atol=0.7
    )  # later than the l in the field
    np.testing.assert_allclose(
        1e3 * recording.axes.T @ (recording.tip - before)[:3], [0.0, 0.0, -5.0], atol=0.7
    )


def test_centre_and_the_key_held_down_lead_to_the_seat_where_the_page_says_end(recording: Teaching):
    tab = recording.tab
    tab.advises("Press Centre")
    tab.press("Centre")
    tab.advises("On the axis: hold the key I")
    tab.page.keyboard.down("i")
    expect(tab.tp("advice")).to_contain_text(re.compile("Push on|At the bottom"), timeout=WAIT_MS)
    expect(tab.tp("gauge-depth")).to_have_text(re.compile(r"^\d+ of 85 mm deep$"), timeout=WAIT_MS)
    recording.until(lambda p: p.own_arm is not None and p.own_arm.depth_m > 0.080)
    tab.page.keyboard.up("i")
    tab.advises("Seated: press End")
    seed = recording.it.picture.own_arm.seed  # pyright: ignore[reportOptionalMemberAccess]
    tab.insist("End", "demos", "1")
    tab.insist("Record", "recording", "RECORDING")  # and the next one begins elsewhere
    recording.until(lambda p: p.recording and p.own_arm is not None and p.own_arm.seed == seed + 1)


def test_the_gauge_and_the_words_lie_over_nothing_in_any_size_and_have_contrast_and_names(
    recording: Teaching,
):
    tab = recording.tab
    expect(tab.tp("gauge-depth")).to_be_attached(timeout=WAIT_MS)
    assert_legible(tab, [*SIZES, *SMALL_SIZES])
    assert_legible(tab, [SIZES[0], *SMALL_SIZES[:2]], drawer=True)
    assert_accessible(tab)
    with drawer_open(tab, True):
        assert_accessible(tab)


def _released(recording: Teaching) -> None:
    recording.pad(False, 1.0, 0.0, 0.0, 0.0)


def _gone(recording: Teaching) -> None:
    recording.tab.page.evaluate("() => { window.pad = null }")


def _hidden(recording: Teaching) -> None:
    _set_hidden(recording, True)


def _set_hidden(recording: Teaching, hidden: bool) -> None:
    recording.tab.page.evaluate(_SET_HIDDEN, hidden)


@pytest.mark.parametrize("ends", [_released, _gone, _hidden])
def test_a_gamepad_moves_the_hand_only_while_its_dead_man_is_held(
    recording: Teaching, ends: Callable[[Teaching], None]
):
    before = recording.rest()
    recording.pad(False, 1.0, 0.0, 0.0, 0.0)
    expect(recording.tab.page.locator("body[data-pad]")).to_be_attached(timeout=WAIT_MS)
    recording.tab.frames(4)
    assert np.linalg.norm(recording.rest()[:3] - before[:3]) < 1e-3, (
        "without the dead-man the stick counts for nothing"
    )
    recording.pad(True, 1.0, 0.0, 0.0, 0.0)
    recording.until(
        lambda p: p.own_arm is not None and float(np.linalg.norm(p.own_arm.tip[:3] - before[:3])) > 0.02
    )
    way = recording.axes.T @ (recording.tip - before)[:3]
    assert way[0] > 0.9 * np.linalg.norm(way), "to the right"
    ends(recording)
    there = recording.rest()
    _set_hidden(recording, False)
    recording.tab.frames(4)
    assert np.linalg.norm(recording.rest()[:3] - there[:3]) < 1e-3, (
        "what is still held counts once it is pressed again"
    )
    _gone(recording)
