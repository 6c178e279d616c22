"""The arm's task by mouse: a demonstration by the arrows at the plug, then the whole job until it is seated."""

from __future__ import annotations

import re
from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser

from local_site.arm_view import ArmView
from local_site.held_arm import HeldArm
from tests.browser.arm_page import ArmPage
from tests.browser.stack import Stack, farhand_up
from tests.browser.test_layout import assert_legible

# In software an arm is drawn slowly: these take two minutes on two quiet cores.
pytestmark = pytest.mark.soak


@pytest.fixture(scope="module")
def stack(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Stack]:
    """Both sites over the `geo` profile with the task as it is shipped."""
    with farhand_up(tmp_path_factory.mktemp("arm") / "data", link="geo", task="hot-stab") as stack:
        yield stack


@pytest.fixture(scope="module")
def tab(browser: Browser, stack: Stack) -> Iterator[ArmPage]:
    """One tab for all tests here: drawing an arm in software is slow the first time."""
    tab = ArmPage(browser.new_context(viewport={"width": 900, "height": 560}).new_page())
    tab.open(stack.address)
    yield tab
    tab.page.context.close()
    assert tab.problems == []


@pytest.fixture(scope="module")
def at_first() -> ArmView:
    """The operator's arm as the site puts it at first."""
    return HeldArm("insert", seed=0).view()


def test_dragging_an_arrow_demonstrates_with_the_operators_arm(tab: ArmPage, at_first: ArmView) -> None:
    tab.advises("Record")
    tab.press("Record")
    tab.says("recording", "RECORDING")
    with tab.hold_arrow(at_first.tip, axis=2, length_m=0.06):
        tab.says("components", re.compile("^[1-9]"))
    tab.press("End")
    tab.says("demos", "1")
    tab.press("Undo")
    tab.says("demos", "0")


@pytest.mark.timeout(170)
def test_the_samples_lead_to_a_seated_plug_by_clicks_alone(tab: ArmPage) -> None:
    for button in ("Load samples", "Send model", "Arm", "Preview", "Execute"):
        tab.advises(button)
        tab.press(button)
        tab.says("pending", "none")
    tab.says("demos", "5")
    tab.says("phase", "SEATED")
    tab.says("mode", "AUTONOMOUS")
    tab.says("depth", re.compile(r"^(7[5-9]|8\d|9[0-5]) mm deep$"))
    assert 0.0 < tab.number("force") < 60.0
    assert_legible(tab)
