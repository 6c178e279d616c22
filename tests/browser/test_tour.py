"""First-timers and the keyboard: a tour of five cards that covers no STOP, and every action within reach of Tab, by a name."""

from __future__ import annotations

from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from farhand.common.mode_table import ControlMode
from farhand.common.wire.messages import Stop
from tests.browser.desk_page import await_new_stop, page_of
from tests.browser.operator_page import WAIT_MS
from tests.browser.test_small_windows import assert_in_sight, opened

# Whatever is drawn and can be operated, by its name.
OFFERED = """() => [...document.querySelectorAll('button, input:not([type=hidden]), [role=slider], [tabindex="0"]')]
  .filter((each) => each.checkVisibility({ visibilityProperty: true }) && !each.disabled && each.tabIndex >= 0
    && each.getBoundingClientRect().width > 0)
  .map((each) => each.getAttribute('aria-label') || each.textContent.trim() || each.labels?.[0]?.textContent || each.outerHTML)"""
FOCUSED = """() => { const each = document.activeElement;
  return each.getAttribute('aria-label') || each.textContent.trim() || each.labels?.[0]?.textContent || ''; }"""


@pytest.mark.parametrize("size", [(1024, 600), (768, 1024)], ids=lambda size: f"{size[0]}x{size[1]}")
def test_the_tour_opens_once_covers_no_stop_and_is_remembered(
    browser: Browser, tmp_path: Path, size: tuple[int, int]
) -> None:
    with page_of(tmp_path, mode=ControlMode.AUTONOMOUS) as (it, page), it.robot.reporting():
        tab = opened(browser, page.address, size)
        tour = tab.locator("#fh-tour")
        for card in range(1, 6):
            expect(tab.get_by_role("dialog", name=f"Tour, card {card} of 5")).to_be_in_viewport(ratio=1.0)
            assert_in_sight(tab)
            tab.get_by_role("button", name="Done" if card == 5 else "Next", exact=True).click()
        expect(tour).to_have_count(0)
        tab.reload()
        expect(tab.locator("[data-tp=mode]")).to_have_text("AUTONOMOUS", timeout=WAIT_MS)
        expect(tour).to_have_count(0)
        tab.get_by_role("button", name="Help", exact=True).click()
        expect(tour).to_be_visible()
        n = len({each.stop_id for each in it.robot.heard(Stop)})
        tab.keyboard.press("Escape")  # is STOP, also while a card is shown
        await_new_stop(it, n)
        tab.get_by_role("button", name="Skip the tour", exact=True).click()
        expect(tour).to_have_count(0)
        tab.context.close()


def test_every_action_is_reached_by_tab_and_has_a_name(browser: Browser, tmp_path: Path) -> None:
    with page_of(tmp_path, mode=ControlMode.HOLD) as (it, page), it.robot.reporting():
        tab = browser.new_context(viewport={"width": 1280, "height": 720}).new_page()
        tab.goto(f"{page.address}?fixedDpr=0.25")
        expect(tab.locator("[data-tp=mode]")).to_have_text("HOLD", timeout=WAIT_MS)
        tab.get_by_role("button", name="Skip the tour").click()
        expect(tab.get_by_role("slider", name="Look back [s]")).to_be_visible(timeout=WAIT_MS)
        tab.get_by_role("button", name="More", exact=True).click()
        expect(tab.get_by_role("button", name="Only watch", exact=True)).to_be_visible(timeout=WAIT_MS)
        offered = set(tab.evaluate(OFFERED))
        assert (
            "" not in offered and {"STOP", "Record", "Help", "Timeline", "Speed [%]", "Only watch"} <= offered
        )
        reached = set()
        for _ in range(4 * len(offered)):
            tab.keyboard.press("Tab")
            reached.add(tab.evaluate(FOCUSED))
        assert offered <= reached, offered - reached
        assert tab.locator("[role=alert]").count() and tab.locator("#fh-live[aria-live=polite]").count()
        tab.context.close()
