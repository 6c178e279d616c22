"""What was taught is kept: gone back to by mouse, and there again for the next process."""

from __future__ import annotations

from pathlib import Path

from playwright.sync_api import Browser, expect

from tests.browser.operator_page import WAIT_MS, OperatorPage
from tests.browser.stack import farhand_up, still_task


def test_a_revision_is_gone_back_to_and_the_next_process_begins_with_it(
    browser: Browser, tmp_path: Path
) -> None:
    context = browser.new_context(viewport={"width": 900, "height": 1400})
    try:
        with farhand_up(tmp_path / "data", task=still_task(tmp_path)) as stack:
            tab = OperatorPage(context.new_page())
            tab.open(stack.address)
            tab.press("Load samples")
            tab.says("demos", "3")
            three = stack.model_file.read_bytes()
            tab.page.get_by_text("Library", exact=True).click()
            expect(tab.button("Go to")).to_be_disabled(timeout=WAIT_MS)
            tab.press("Start anew")
            tab.says("demos", "0")
            choose_revision(tab, "3: 3 demonstrations")
            tab.press("Go to")
            tab.says("demos", "3")
            tab.tells("revision 3 counts now")
            assert stack.model_file.read_bytes() == three
            choose_revision(tab, "1: 1 demonstration,")
            tab.press("Delete")
            tab.tells("revision 1 was deleted")
            assert tab.problems == []
        with farhand_up(tmp_path / "data", task=still_task(tmp_path)) as stack:
            tab.open(stack.address)
            tab.says("demos", "3")
            assert stack.model_file.read_bytes() == three
            tab.press("Undo")
            tab.says("demos", "2")
    finally:
        context.close()


def choose_revision(tab: OperatorPage, label: str) -> None:
    tab.page.get_by_role("combobox", name="Revision").click()
    tab.page.get_by_role("option").filter(has_text=label).click()
