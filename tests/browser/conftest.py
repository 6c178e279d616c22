"""A browser and a running Farhand, one of each per module; a tab per test."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import pytest
from playwright.sync_api import Browser, sync_playwright

from tests.browser.operator_page import CHROMIUM, OperatorPage, launch
from tests.browser.stack import Stack, farhand_up, still_task
from tests.browser.tabs import tabs_of

NewTab = Callable[[], OperatorPage]

PATIENCE_S = 400
"""A browser that draws in software on a busy machine is slow; each of its waits has a deadline of its own [s]."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if "/tests/browser/" in item.path.as_posix():
            item.add_marker(pytest.mark.browser)
            if item.get_closest_marker("timeout") is None:
                item.add_marker(pytest.mark.timeout(PATIENCE_S))


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    if CHROMIUM is None:
        pytest.skip("NO CHROMIUM on this machine: the page is not tested (Debian: apt-get install chromium)")
    with sync_playwright() as playwright:
        browser = launch(playwright)
        yield browser
        browser.close()


@pytest.fixture(scope="module")
def stack(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Stack]:
    """Both sites over the `lan` profile with a U that stands still."""
    folder = tmp_path_factory.mktemp("stack")
    with farhand_up(folder / "data", task=still_task(folder)) as stack:
        yield stack


@pytest.fixture
def new_tab(browser: Browser, stack: Stack) -> Iterator[NewTab]:
    """Opens tabs that are closed with the test."""
    with tabs_of(browser, OperatorPage, 900, 560) as open_one:
        yield partial(open_one, stack)


@pytest.fixture
def tab(new_tab: NewTab) -> OperatorPage:
    """The active tab, the robot DISARMED."""
    tab = new_tab()
    tab.disarmed()
    return tab
