"""Two tabs, reload, and a local site that dies."""

from __future__ import annotations

from playwright.sync_api import expect

from tests.browser.conftest import NewTab
from tests.browser.operator_page import WAIT_MS, OperatorPage


def told(tab: OperatorPage) -> dict[str, str]:
    return {name: tab.tp(name).inner_text() for name in ("mode", "holder", "demos", "components", "model")}


def await_told(tab: OperatorPage, before: dict[str, str]) -> None:
    for name, words in before.items():
        tab.says(name, words)


def test_a12_a_second_tab_watches_until_the_first_is_closed(tab: OperatorPage, new_tab: NewTab) -> None:
    tab.taught()
    tab.command("Arm", "HOLD")
    watching = new_tab()
    watching.says("session", "watching")
    await_told(watching, told(tab))
    expect(watching.tp("role")).to_contain_text("This tab watches")
    watching.button("Disarm").dispatch_event("click")  # it is not to be seen, but a script may press it
    expect(watching.tp("role")).to_contain_text("this tab only watches", timeout=WAIT_MS)
    expect(tab.tp("role")).to_have_count(0)  # what another tab tries does not stand here
    watching.says("mode", "HOLD")
    watching.command("STOP", "STOPPED")  # anybody may stop
    tab.command("Reset", "DISARMED")
    watching.press("Take over")
    tab.press("Keep control")
    expect(watching.tp("role")).to_contain_text("The other tab keeps control", timeout=WAIT_MS)
    watching.says("session", "watching")
    watching.press("Take over")
    watching.says("session", "active")
    tab.says("session", "watching")
    tab.press("Take over")
    watching.says("session", "watching")
    tab.page.close()
    watching.says("session", "free")
    watching.command("Arm", "HOLD")
    watching.says("session", "active")


def test_a_reload_keeps_everything(tab: OperatorPage) -> None:
    tab.taught()
    tab.command("Arm", "HOLD")
    before = told(tab)
    tab.page.reload()
    tab.settle()
    await_told(tab, before)
    tab.command("Disarm", "DISARMED")


def test_closing_the_tab_that_drives_ends_the_drag(tab: OperatorPage, new_tab: NewTab) -> None:
    tab.command("Arm", "HOLD")
    tab.command("Couple", "DIRECT")
    tab.page.mouse.move(*tab.pixel((0.3, 0.3)))
    tab.page.mouse.down()
    tab.page.mouse.move(*tab.pixel((0.32, 0.32)))
    tab.page.close()
    left = new_tab()
    left.says("mode", "HOLD")
    left.tells("decoupled")
