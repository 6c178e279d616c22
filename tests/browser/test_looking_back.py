"""Looking back over the session: the robot as it was is marked, and the present stays in command."""

from __future__ import annotations

import re
from pathlib import Path

from playwright.sync_api import Browser, Page, expect

from farhand.common.mode_table import ControlMode
from farhand.common.wire.messages import Stop
from tests.browser.desk_page import page_of
from tests.browser.operator_page import WAIT_MS, OperatorPage

# Where a moment is on the timeline, in seconds before now [px].
PLACE = """(back) => {
  const svg = document.querySelector('[data-tp=timeline] svg'), { left, right, span } = svg.dataset;
  const { a, e, f, d } = svg.getScreenCTM();
  return [e + a * (right - (back / span) * (right - left)), f + 40 * d];
}"""


def scrub(page: Page, back_s: float) -> None:
    """Drag along the timeline to a moment so long ago."""
    page.mouse.move(*page.evaluate(PLACE, back_s + 20.0))
    page.mouse.down()
    page.mouse.move(*page.evaluate(PLACE, back_s))
    page.mouse.up()


def test_the_past_is_marked_until_back_to_now_and_stop_returns_to_the_present(
    browser: Browser, tmp_path: Path
) -> None:
    with page_of(tmp_path, mode=ControlMode.HOLD) as (it, page), it.robot.reporting():
        tab = OperatorPage(browser.new_context(viewport={"width": 1280, "height": 720}).new_page())
        tab.goto(page.address)
        past, back = tab.tp("past"), tab.button("Back to now")
        expect(tab.page.locator(".fh-lane-hold").first).to_be_attached(timeout=WAIT_MS)
        slider = tab.page.get_by_role("slider", name="Look back [s]")
        expect(slider).to_be_visible(timeout=WAIT_MS)
        scrub(tab.page, 60.0)
        expect(past).to_contain_text(re.compile("^[0-9]+ s ago, not now: HOLD"), timeout=WAIT_MS)
        expect(tab.page.locator(".fh-past-frame")).to_be_visible()
        it.robot.report(ControlMode.STOPPED)
        tab.says("mode", "STOPPED")  # the band is of the present
        expect(past).to_contain_text("HOLD")
        tab.not_offered("Reset")
        back.click()
        expect(past).to_have_count(0, timeout=WAIT_MS)
        expect(back).to_have_count(0, timeout=WAIT_MS)
        slider.focus()
        slider.press("Home")  # by keyboard: as long ago as the timeline is
        expect(past).to_contain_text("not now", timeout=WAIT_MS)
        tab.press("STOP")
        it.robot.wait_for(Stop)
        expect(past).to_have_count(0, timeout=WAIT_MS)
        assert tab.problems == []
        tab.page.context.close()
