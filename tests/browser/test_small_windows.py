"""STOP and the mode are in sight in every window, whatever was tapped, and work by mouse, touch and Escape."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Locator, Page, expect

from farhand.common.mode_table import Action, ControlMode
from farhand.common.wire.messages import Command, Stop
from tests.browser.desk_page import await_new_stop, page_of
from tests.browser.operator_page import WAIT_MS, OperatorPage
from tests.browser.test_layout import SMALL_SIZES, assert_legible
from tests.local_site.robot_end import Desk

NARROW = [(390, 844), (320, 568), (575, 700), (576, 700), (699, 400)]
WIDE = [(700, 500), (844, 390), (1024, 600), (1280, 720)]
_WHOLE_WIDTH = """() => {
  const { x, width } = document.querySelector("canvas[data-engine]")?.getBoundingClientRect() ?? {};
  return x === 0 && width === innerWidth;
}"""
ON_TOP = """(button) => {
  const { x, y, width, height } = button.getBoundingClientRect();
  const at = (across, down) => document.elementFromPoint(x + across * width, y + down * height);
  return [[0.5, 0.5], [0.05, 0.1], [0.95, 0.1], [0.05, 0.9], [0.95, 0.9]].every(([a, d]) => button.contains(at(a, d)));
}"""


@pytest.fixture(scope="module")
def moving(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Desk, str]]:
    """A robot that executes, and the page's address."""
    with page_of(tmp_path_factory.mktemp("data"), mode=ControlMode.AUTONOMOUS) as (it, page):
        yield it, page.address


def opened(browser: Browser, address: str, size: tuple[int, int]) -> Page:
    width, height = size
    context = browser.new_context(viewport={"width": width, "height": height}, has_touch=True)
    tab = context.new_page()
    tab.goto(f"{address}?fixedDpr=0.25")
    expect(tab.locator("[data-tp=mode]")).to_have_text("AUTONOMOUS", timeout=WAIT_MS)
    return tab


def assert_in_sight(tab: Page) -> Locator:
    """STOP is whole, on top of all else, and the only one of its name; the mode is in sight, too."""
    stop = tab.get_by_role("button", name="STOP", exact=True)
    expect(stop).to_be_in_viewport(ratio=1.0, timeout=WAIT_MS)
    assert stop.evaluate(ON_TOP), f"STOP is covered at {tab.viewport_size}"
    assert tab.viewport_size is not None
    narrow = tab.viewport_size["width"] < 700
    shown = tab.locator("[data-narrow=mode]" if narrow else "[data-tp=mode]")
    expect(shown).to_be_in_viewport(ratio=1.0)
    expect(shown).to_contain_text("AUTONOMOUS")
    return stop


@pytest.mark.parametrize("size", [*NARROW, *WIDE], ids=lambda size: f"{size[0]}x{size[1]}")
def test_a2_stop_and_mode_are_in_sight_and_stop_whatever_was_tapped(
    browser: Browser, moving: tuple[Desk, str], size: tuple[int, int]
) -> None:
    it, address = moving
    tab = opened(browser, address, size)
    stop = assert_in_sight(tab)
    n = len({each.stop_id for each in it.robot.heard(Stop)})
    stop.tap()
    n = await_new_stop(it, n)
    width, height = size
    box = stop.bounding_box()
    assert box is not None
    for down in range(12, height, 60):
        for across in (width // 8, width // 2, width - 12):
            if not (across < box["x"] + box["width"] + 8 and down < box["y"] + box["height"] + 8):
                tab.touchscreen.tap(across, down)
    assert_in_sight(tab).click()
    n = await_new_stop(it, n)
    tab.keyboard.press("Escape")
    await_new_stop(it, n)
    tab.context.close()


def test_no_two_texts_overlap_and_none_is_cut_in_a_small_window_in_any_mode(
    browser: Browser, tmp_path: Path
) -> None:
    with page_of(tmp_path, mode=ControlMode.DISARMED) as (it, page), it.robot.reporting():
        tab = OperatorPage(browser.new_context(viewport={"width": 1024, "height": 600}).new_page())
        tab.goto(page.address)
        expect(tab.page.get_by_role("slider", name="Look back [s]")).to_be_visible(timeout=WAIT_MS)
        for mode in ControlMode:
            it.robot.report(mode)
            tab.says("mode", mode.name)
            assert_legible(tab, SMALL_SIZES)
            assert_legible(tab, SMALL_SIZES[:2], drawer=True)
        tab.page.locator("#fh-help").click()
        assert_legible(tab, SMALL_SIZES)
        tab.page.context.close()


def test_a_narrow_window_says_what_the_robot_does_and_pauses_and_aborts(
    browser: Browser, tmp_path: Path
) -> None:
    with page_of(tmp_path, mode=ControlMode.AUTONOMOUS) as (it, page), it.robot.reporting():
        tab = opened(browser, page.address, (390, 844))
        expect(tab.locator("[data-narrow=note]")).to_be_in_viewport()
        expect(tab.locator("[data-narrow=age]")).to_contain_text("old, link")
        tab.get_by_role("button", name="Pause", exact=True).tap()
        it.robot.wait_for(Command, 1)
        it.robot.report(ControlMode.PAUSED)
        expect(tab.locator("[data-narrow=mode]")).to_contain_text("PAUSED", timeout=WAIT_MS)
        tab.get_by_role("button", name="Abort", exact=True).tap()
        assert [each.action for each in it.robot.wait_for(Command, 2)] == [Action.PAUSE, Action.ABORT]
        expect(tab.locator("[data-narrow=advice]")).to_have_text(
            "Paused, and kept. Press Resume to go on, or Abort."
        )
        it.robot.report(ControlMode.HOLD)
        expect(tab.locator("[data-narrow=advice]")).to_contain_text("in a larger window", timeout=WAIT_MS)
        expect(tab.get_by_role("button", name="Abort", exact=True)).to_be_hidden(timeout=WAIT_MS)
        tab.get_by_role("button", name="STOP", exact=True).tap()
        expect(tab.locator("[data-narrow=alarm]")).to_contain_text("STOP NOT DELIVERED", timeout=WAIT_MS)
        tab.context.close()


def test_a15_at_every_load_the_scene_has_the_whole_width_and_no_panel_lies_beside_it(
    browser: Browser, tmp_path: Path
) -> None:
    """A panel whose width depended on the load once lay over the mode, and stayed there."""
    with page_of(tmp_path, mode=ControlMode.AUTONOMOUS) as (
        _it,
        page,
    ):  # whose STOP nobody has pressed: no alarm
        for _ in range(5):
            tab = OperatorPage(browser.new_context(viewport={"width": 1280, "height": 720}).new_page())
            tab.goto(page.address)
            tab.page.wait_for_function(_WHOLE_WIDTH, timeout=WAIT_MS)
            tab.settle()
            assert tab.page.evaluate(_WHOLE_WIDTH)
            tab.page.context.close()


@pytest.mark.parametrize("size", [(390, 844), (1280, 720)])
def test_a16_a_dead_local_site_covers_no_stop_and_says_what_to_do_instead(
    browser: Browser, tmp_path: Path, size: tuple[int, int]
) -> None:
    with page_of(tmp_path, mode=ControlMode.AUTONOMOUS) as (_it, page):
        tab = opened(browser, page.address, size)
    banner = tab.locator("[data-tp=stale]")
    expect(banner).to_have_css("opacity", "1", timeout=WAIT_MS)
    expect(banner).to_contain_text(re.compile("NO NEWS.*Stop the robot at its own site"))
    stop, silence = (each.bounding_box() for each in (tab.locator("#fh-stop"), banner))
    assert stop is not None and silence is not None
    assert silence["x"] >= stop["x"] + stop["width"]
    tab.context.close()
