from __future__ import annotations

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, sync_playwright

from tests.browser.arm_page import ArmPage
from tests.browser.operator_page import CHROMIUM, launch
from tests.containers.engine import BUILD_S, Engine, find_engine
from tests.containers.place import Place


@pytest.fixture(scope="package")
def engine() -> Iterator[Engine]:
    """An engine on which the image is built from this work tree."""
    engine = find_engine()
    built = engine.compose("build", "robot", timeout_s=BUILD_S)  # all three run the same
    assert built.returncode == 0, built.stdout[-3000:] + built.stderr[-3000:]
    yield engine
    engine.compose("down", "--volumes", "--timeout", "5", timeout_s=120)


@pytest.fixture(scope="package")
def place(engine: Engine) -> Place:
    """Both sites and the link as compose.yaml starts them, from a clean state, and nothing else said."""
    place = Place(engine)
    engine.compose("down", "--volumes", "--timeout", "5", timeout_s=120)
    place.up()
    return place


@pytest.fixture(scope="package")
def browser() -> Iterator[Browser]:
    """A browser on this machine, not in a container."""
    if CHROMIUM is None:
        pytest.skip("NO CHROMIUM on this machine: the page is not tested (Debian: apt-get install chromium)")
    with sync_playwright() as playwright:
        browser = launch(playwright)
        yield browser
        browser.close()


@pytest.fixture(scope="package")
def tab(browser: Browser, place: Place) -> Iterator[ArmPage]:
    """A tab on the published page, loaded once for all."""
    context = browser.new_context(viewport={"width": 840, "height": 560}, timezone_id="Asia/Tokyo")
    tab = ArmPage(context.new_page())
    tab.open(place.address)
    yield tab
    context.close()
    assert tab.problems == []
