"""The paper's own set-up on the page: Baxter's left arm demonstrates, its right arm executes; from the samples to SEATED."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser

from tests.browser.arm_page import BAXTER, BaxterPage
from tests.browser.stack import Stack, farhand_up
from tests.browser.tabs import tabs_of

# In software two Baxters are drawn slowly.
pytestmark = [pytest.mark.soak, pytest.mark.timeout(600)]


@pytest.fixture(scope="module")
def stack(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Stack]:
    """Baxter's left arm at the operator's site, its right arm as the robot."""
    with farhand_up(tmp_path_factory.mktemp("baxter") / "data", "lan", "hot-stab", *BAXTER) as stack:
        yield stack


def test_what_the_left_arm_has_shown_the_right_arm_does(browser: Browser, stack: Stack) -> None:
    with tabs_of(browser, BaxterPage, 1280, 720) as open_one:
        tab = open_one(stack)  # each arm is drawn in its half, in its colour
        tab.press("Load samples")
        tab.says("demos", "5")
        tab.execute_until_seated()
