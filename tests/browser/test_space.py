"""A task in space with two frames on the page: drawn over the board with a height, taught by samples, executed to its end."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser

from tests.browser.operator_page import OperatorPage
from tests.browser.stack import Stack, farhand_up
from tests.browser.tabs import tabs_of

pytestmark = pytest.mark.soak
FILE = Path(__file__).parents[2] / "examples" / "tasks" / "over-wall.toml"
STROKE = [(0.10 + 0.02 * k, 0.50) for k in range(20)]


@pytest.fixture(scope="module")
def stack(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Stack]:
    with farhand_up(tmp_path_factory.mktemp("space") / "data", task=FILE) as stack:
        yield stack


def test_it_is_drawn_with_a_height_and_executed_to_its_end(browser: Browser, stack: Stack) -> None:
    with tabs_of(browser, OperatorPage, 1280, 720) as open_one:
        tab = open_one(stack)
        tab.press("Record")
        tab.says("recording", "RECORDING")
        tab.slide("Height of the hand [m]", 0.6)
        with tab.hold(STROKE):
            tab.says("components", re.compile("^[1-9]"))
        tab.press("Undo")
        tab.says("recording", "")
        tab.press("New place")
        tab.tells("the frames on your board are elsewhere")
        tab.press("Load samples")
        tab.says("demos", "15")
        tab.press("Send model")
        tab.says("model", re.compile("robot has it"))
        tab.command("Arm", "HOLD")
        tab.press("Preview")
        tab.tells(re.compile("previewed .* s of motion"))
        tab.command("Execute", "AUTONOMOUS")
        tab.says("phase", "ARRIVED")
