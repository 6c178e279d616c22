"""Tabs of one browser: closed in the end, and none may have had an error."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeVar

from playwright.sync_api import Browser

from tests.browser.operator_page import OperatorPage
from tests.browser.stack import Stack

PageKind = TypeVar("PageKind", bound=OperatorPage)


@contextmanager
def tabs_of(
    browser: Browser, kind: type[PageKind], width: int, height: int
) -> Iterator[Callable[[Stack], PageKind]]:
    """What opens a tab on the page of a stack.

    Args:
        browser: Whose.
        kind: Of the page.
        width: Of the window [px].
        height: Of the window [px].
    """
    tabs: list[PageKind] = []

    def open_one(stack: Stack) -> PageKind:
        context = browser.new_context(viewport={"width": width, "height": height})
        tabs.append(tab := kind(context.new_page()))
        tab.open(stack.address)
        return tab

    yield open_one
    for tab in tabs:
        tab.page.context.close()
        assert tab.problems == []
