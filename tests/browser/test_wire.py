"""A client that is no browser: it can press what is disabled and send what no slider sends."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from playwright.sync_api import expect

from tests.browser.conftest import NewTab
from tests.browser.operator_page import WAIT_MS, OperatorPage
from tests.browser.raw_client import RawClient, raw_connection
from tests.browser.stack import Stack


@pytest.fixture(scope="module")
def raw(stack: Stack) -> Iterator[RawClient]:
    """A raw client that came first, before every tab here: it is the one that may act."""
    with raw_connection(stack.address) as connection:
        yield RawClient(connection)


@pytest.fixture
def watching(raw: RawClient, new_tab: NewTab) -> OperatorPage:
    """A tab that shows what became of it."""
    tab = new_tab()
    tab.says("session", "watching")
    return tab


def test_a_raw_client_cannot_do_what_the_table_of_modes_forbids(
    raw: RawClient, watching: OperatorPage
) -> None:
    for label in ("Execute", "Couple", "Abort", "Reset", "Clutch", "Preview"):
        watching.not_offered(label)
        raw.press(label)
        watching.tells(f"{label.lower()}: refused: {label.lower()} is not allowed in DISARMED")
    watching.says("mode", "DISARMED")
    watching.says("pending", "none")


def test_what_lies_outside_a_slider_is_clamped(raw: RawClient, watching: OperatorPage) -> None:
    # At 0 in the end: the next test is not one of a link that takes six seconds there and back.
    for value, clamped in ((1e9, "3000"), (float("nan"), "3000"), (1e12, "3000"), (-5.0, "0")):
        raw.set("One-way delay [ms]", value=value)
        expect(watching.slider("One-way delay [ms]")).to_have_value(clamped, timeout=WAIT_MS)
    watching.says("link", "OK")
    watching.says("mode", "DISARMED")


def test_nobody_can_take_the_stop_button_away(raw: RawClient, watching: OperatorPage) -> None:
    for attribute in ({"removed": True}, {"update_cb": []}, {"value": True, "is_button": False}):
        raw.set("STOP", **attribute)
    watching.command("STOP", "STOPPED")
    expect(watching.button("Reset")).to_be_enabled(timeout=WAIT_MS)  # once the stop is acknowledged
    raw.press("Reset")
    watching.says("mode", "DISARMED")
