"""The page when its server is killed: it must not go on showing what it showed."""

from __future__ import annotations

import re

from playwright.sync_api import expect

from tests.browser.operator_page import WAIT_MS, OperatorPage
from tests.browser.stack import Stack


def test_a_killed_local_site_is_said_by_the_page_itself(tab: OperatorPage, stack: Stack) -> None:
    expect(tab.tp("stale")).to_have_css("opacity", "0", timeout=WAIT_MS)
    stack.kill("local")
    expect(tab.tp("stale")).to_have_css("opacity", "1", timeout=WAIT_MS)
    tab.says("stale", re.compile(r"NO NEWS from the local site for \d+ s"))
