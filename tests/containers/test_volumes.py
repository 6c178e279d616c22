"""What was taught and where the robot is outlives the containers, until it is asked to be forgotten."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import Browser

from tests.browser.arm_page import ArmPage
from tests.containers.engine import BUILD_S, RUN_S
from tests.containers.place import Place

pytestmark = [pytest.mark.containers, pytest.mark.soak, pytest.mark.timeout(BUILD_S + 2 * RUN_S)]


def open_tab(browser: Browser, place: Place) -> ArmPage:
    tab = ArmPage(browser.new_context(viewport={"width": 840, "height": 560}).new_page())
    tab.open(place.address)
    return tab


def test_what_was_taught_is_there_after_down_and_up_and_forgotten_on_request(
    browser: Browser, place: Place
) -> None:
    tab = open_tab(browser, place)
    if tab.tp("demos").inner_text() != "5":
        tab.press("Load samples")
        tab.says("demos", "5")
    tab.insist("Send model", "model", re.compile("robot has it"))
    tab.seat()
    tab.page.context.close()
    place.compose("down", "--timeout", "10")
    place.up()
    tab = open_tab(browser, place)
    tab.says("mode", "DISARMED")
    tab.says("demos", "5")
    tab.says("model", re.compile("robot lacks it"))
    tab.says("depth", re.compile("mm deep"))  # the simulated robot is where it was
    tab.insist("Send model", "model", re.compile("robot has it"))
    tab.page.context.close()
    events = place.run("operator", "sh", "-c", "cat /data/farhand/operator/*/events.jsonl")
    assert "restarted" in events or "seated" in events.lower()
    place.compose("down", "--volumes", "--timeout", "10")
    place.up()
    tab = open_tab(browser, place)
    tab.says("demos", "0")
    tab.says("depth", re.compile("mm away"))
    tab.page.context.close()
