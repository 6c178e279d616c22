"""The link panel, and what the page does while the link is slow or dead."""

from __future__ import annotations

import re

from playwright.sync_api import expect

from tests.browser.operator_page import WAIT_MS, OperatorPage


def test_the_delay_slider_changes_the_age_of_the_data_at_once(tab: OperatorPage) -> None:
    expect(tab.page.get_by_text("Link (simulated)")).to_be_attached(timeout=WAIT_MS)
    tab.slide("One-way delay [ms]", 500)
    tab.says("age", re.compile(r"^(0\.[5-9]|[1-9])"))
    tab.slide("One-way delay [ms]", 0)
    tab.says("age", re.compile(r"^0\.[0-3]"))


def test_a_profile_is_taken_as_a_whole(tab: OperatorPage) -> None:
    choose(tab, "geo")
    expect(tab.slider("One-way delay [ms]")).to_have_value("300", timeout=WAIT_MS)
    expect(tab.slider("Jitter [ms]")).to_have_value("20", timeout=WAIT_MS)
    tab.says("age", re.compile(r"^0\.[3-9]"))
    choose(tab, "lan")
    tab.says("age", re.compile(r"^0\.[0-2]"))


def test_a_link_that_dies_and_comes_back_interrupts_neither_the_robot_nor_the_operator(
    tab: OperatorPage,
) -> None:
    tab.taught()
    tab.command("Arm", "HOLD")
    tab.command("Execute", "AUTONOMOUS")
    tab.slide("Cut for [s]", 12)
    tab.press("Cut")
    popups = tab.page.locator("[role=dialog]:visible, .mantine-Notification-root:visible")
    tab.says("link", "LOST")
    tab.says("silence", re.compile(r"silent for \d+ s"))
    tab.says("mode", "AUTONOMOUS")
    assert "OLD" in tab.tp("seen").inner_text()
    expect(popups).to_have_count(0)
    tab.says("link", "OK")
    tab.says("phase", "ARRIVED")
    expect(popups).to_have_count(0)
    tab.command("Abort", "HOLD")


def choose(tab: OperatorPage, profile: str) -> None:
    tab.pick("Profile", tab.page.get_by_role("option", name=profile, exact=True))
