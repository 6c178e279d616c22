"""A newcomer's first minute on the shipped task, and what the page asks of the browser."""

from __future__ import annotations

import re
from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser

from tests.browser.board_picture import seen_point
from tests.browser.operator_page import OperatorPage
from tests.browser.stack import Stack, farhand_up


@pytest.fixture(scope="module")
def stack(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Stack]:
    """The task as it is shipped."""
    with farhand_up(tmp_path_factory.mktemp("data")) as stack:
        yield stack


def test_the_advice_leads_from_the_samples_to_the_moving_u(tab: OperatorPage, stack: Stack) -> None:
    for button, name, words in (
        ("Load samples", "demos", "3"),
        ("Send model", "model", re.compile("robot has it")),
        ("Arm", "mode", "HOLD"),
        ("Preview", "plan", re.compile("^preview: [0-9]+ s left")),
        ("Execute", "mode", "AUTONOMOUS"),
    ):
        tab.advises(button)
        tab.insist(button, name, words)
    tab.says("phase", "ARRIVED")
    tab.says("mode", "AUTONOMOUS")
    assert seen_point(tab) is not None
    assert any("WebGL support: true" in line for line in tab.console)
    own = (stack.address, "blob:", "data:", stack.address.replace("http", "ws"))
    assert [url for url in tab.requests if not url.startswith(own)] == []
