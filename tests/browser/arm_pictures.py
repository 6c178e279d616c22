"""The arm's job for the pictures of the operator's guide, a picture of each state."""

from __future__ import annotations

import re
from collections.abc import Callable
from contextlib import suppress

from playwright.sync_api import expect

from tests.browser.arm_page import ArmPage
from tests.browser.operator_page import WAIT_MS

SLOWLY_PERCENT = 20.0
"""So that the robot is still on its way when the picture is taken, however slow the browser draws."""

_SEATED = "() => document.querySelector('[data-tp=phase]')?.textContent === 'SEATED'"


def play(tab: ArmPage, shoot: Callable[[str], None]) -> None:
    """Do the whole job with the samples; the link is cut on the way."""
    teach(tab)
    shoot("arm-teaching")
    tab.press("Undo")
    tab.says("recording", "")
    tab.press("Load samples")
    tab.says("demos", "5")
    shoot("arm-learned")
    tab.press("Send model")
    tab.says("model", re.compile("robot has it"))
    tab.command("Arm", "HOLD")
    tab.press("Preview")
    tab.tells(re.compile("previewed .* s of motion"))
    shoot("arm-preview")
    tab.slide("Speed [%]", SLOWLY_PERCENT)
    tab.says("pace", f"at {SLOWLY_PERCENT:.0f}%")
    tab.press("Preview")  # a picture may take longer than a preview counts
    tab.says("plan", re.compile("^preview: 5[0-9] s left$"))
    execute(tab)
    expect(tab.page.locator(".fh-remote")).to_contain_text("to go", timeout=WAIT_MS)
    shoot("page")
    tab.slide("Cut for [s]", 60)
    tab.press("Cut")
    tab.says("link", "LOST")
    shoot("arm-link-cut")
    tab.page.wait_for_function(_SEATED, timeout=5.0 * WAIT_MS)  # the outage, then the rest of the way
    shoot("arm-seated")


def execute(tab: ArmPage) -> None:
    """Press Execute until the robot does: a browser that draws the moving ghost in software is too busy for a mouse."""
    for _ in range(6):
        tab.button("Execute").dispatch_event("click")
        with suppress(AssertionError):
            expect(tab.tp("mode")).to_have_text("AUTONOMOUS", timeout=WAIT_MS / 6.0)
            return
    raise AssertionError("the robot did not execute")


def teach(tab: ArmPage) -> None:
    """Begin a demonstration as the page advises, up to the mouth of the receptacle."""
    tab.press("Record")
    tab.says("recording", "RECORDING")
    tab.advises("Press Centre")
    tab.press("Centre")
    tab.advises("On the axis: hold the key I")
    with tab.key_held("i"):
        tab.says("gauge-depth", re.compile(r"^[1-5]?\d mm to go"))
