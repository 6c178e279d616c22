"""STOP: from every mode, from the keyboard, and while the link is down."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import expect

from tests.browser.operator_page import WAIT_MS, OperatorPage


def reach(tab: OperatorPage, mode: str) -> None:
    """Bring the robot from DISARMED into a mode."""
    if mode in ("HOLD", "DIRECT", "AUTONOMOUS"):
        tab.command("Arm", "HOLD")
    if mode == "DIRECT":
        tab.command("Couple", "DIRECT")
    if mode == "AUTONOMOUS":
        tab.command("Execute", "AUTONOMOUS")


def test_escape_and_the_button_stop_from_every_mode(tab: OperatorPage) -> None:
    tab.taught()
    for mode in ("DISARMED", "HOLD", "DIRECT", "AUTONOMOUS"):
        reach(tab, mode)
        tab.page.keyboard.press("Escape")
        tab.says("mode", "STOPPED")
        tab.command("STOP", "STOPPED")
        tab.not_offered("Arm")
        tab.command("Reset", "DISARMED")


def test_escape_stops_while_a_number_is_being_typed(tab: OperatorPage) -> None:
    tab.command("Arm", "HOLD")
    with tab.reachable(tab.slider("Jitter [ms]")):
        tab.slider("Jitter [ms]").focus()
        tab.page.keyboard.press("Escape")
    tab.says("mode", "STOPPED")


@pytest.mark.parametrize("height", [560, 300])
def test_stop_is_in_sight_however_far_the_panel_is_scrolled(tab: OperatorPage, height: int) -> None:
    tab.page.set_viewport_size({"width": 900, "height": height})
    with tab.reachable(tab.button("Cut")):
        tab.button("Cut").scroll_into_view_if_needed()
        expect(tab.page.locator("#fh-stop")).to_be_in_viewport(ratio=1.0, timeout=WAIT_MS)


def test_a_stop_over_a_dead_link_is_not_delivered_until_it_is(tab: OperatorPage) -> None:
    tab.taught()
    tab.command("Arm", "HOLD")
    tab.command("Execute", "AUTONOMOUS")
    with tab.cut_link():
        tab.press("STOP")
        tab.says(
            "stop",
            re.compile(r"STOP NOT DELIVERED \d+ s: the robot was AUTONOMOUS when last heard \d+ s ago.*"),
        )
        tab.says("mode", "AUTONOMOUS")
    tab.says("mode", "STOPPED")
    tab.says("stop", "")
    expect(tab.tp("stop")).to_be_hidden()
    tab.command("Reset", "DISARMED")
