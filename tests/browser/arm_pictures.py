"""The arm's job for the pictures of the operator's guide, a picture of each state."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
from playwright.sync_api import expect

from farhand.common.model.task_frame import TaskFrame
from farhand.local_site.workcell.held_arm import HeldArm
from tests.browser.arm_page import ArmPage
from tests.browser.operator_page import WAIT_MS
from tests.cells import JACO

SLOWLY_PERCENT = 20.0
"""So that the robot is still on its way when the picture is taken, however slow the browser draws."""

_BEFORE_M = 0.02
"""How far before the mouth the plug is in the picture of teaching [m]."""
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
    tab.command("Execute", "AUTONOMOUS")
    expect(tab.page.locator(".fh-remote")).to_contain_text("to go", timeout=WAIT_MS)
    shoot("page")
    tab.slide("Cut for [s]", 60)
    tab.press("Cut")
    tab.says("link", "LOST")
    shoot("arm-link-cut")
    tab.page.wait_for_function(_SEATED, timeout=5.0 * WAIT_MS)  # the outage, then the rest of the way
    shoot("arm-seated")


def teach(tab: ArmPage) -> None:
    """Begin a demonstration by the arrows, up to the mouth of the receptacle."""
    arm = HeldArm("insert", JACO, tab.seed).view()
    tab.press("Record")
    tab.says("recording", "RECORDING")
    tab.press("Align")
    expect(tab.local).to_contain_text(re.compile(r"\b[01]° askew"), timeout=WAIT_MS)
    tip, frame = np.concatenate([arm.tip[:3], arm.receptacle[3:]]), TaskFrame.at(arm.receptacle)
    for axis, words in ((1, r"green [+-]\d\b"), (0, r"red [+-]\d\b"), (2, r"\b[12]\d mm away")):
        way_m = -float(frame.to_local(tip)[axis]) - (_BEFORE_M if axis == 2 else 0.0)
        with tab.hold_arrow(tip, axis, way_m):
            expect(tab.local).to_contain_text(re.compile(words), timeout=WAIT_MS)
        tip[:3] += way_m * frame.A[:3, axis]
