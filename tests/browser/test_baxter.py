"""The paper's own set-up on the page: Baxter's left arm demonstrates, its right arm executes; from the samples to SEATED."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from playwright.sync_api import Browser

from farhand.common.arm.cell import Cell
from farhand.common.arm.simulation.description import describe
from farhand.deploy.places import find_robot
from tests.browser.arm_page import DEEP, ArmPage
from tests.browser.board_picture import picture_of
from tests.browser.stack import Stack, farhand_up
from tests.browser.tabs import tabs_of

# In software two Baxters are drawn slowly.
pytestmark = [pytest.mark.soak, pytest.mark.timeout(600)]
PICTURE = Path(__file__).parents[2] / "docs" / "pictures" / "baxter.png"


def torso_m(arm: str) -> NDArray[np.float64]:
    """The middle of what stands at an arm's base [m]."""
    base = describe(Cell(robot=find_robot(arm))).links[0]
    return np.concatenate([mesh.vertices_m for mesh in base.meshes]).mean(axis=0).astype(float)


class BaxterPage(ArmPage):
    """One tab of the page between Baxter's arms."""

    arms = ("baxter-left", "baxter-right")
    columns_m = (torso_m("baxter-left"), torso_m("baxter-right"))


@pytest.fixture(scope="module")
def stack(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Stack]:
    """Baxter's left arm at the operator's site, its right arm as the robot."""
    arms = (f"--own-arm={BaxterPage.arms[0]}", f"--robot={BaxterPage.arms[1]}")
    with farhand_up(tmp_path_factory.mktemp("baxter") / "data", "lan", "hot-stab", *arms) as stack:
        yield stack


def test_what_the_left_arm_has_shown_the_right_arm_does(
    browser: Browser, stack: Stack, tmp_path: Path
) -> None:
    with tabs_of(browser, BaxterPage, 1280, 720) as open_one:
        tab = open_one(stack)
        tab.await_scene()  # each in its half, in its colour
        tab.press("Load samples")
        tab.says("demos", "5")
        tab.execute_until_seated()
        tab.says("tip", DEEP)
        picture = tmp_path / PICTURE.name
        picture.write_bytes(tab.page.screenshot(timeout=60_000))
        assert picture_of(picture.read_bytes()).std() > 20.0  # no empty canvas
        if not PICTURE.exists():
            PICTURE.write_bytes(picture.read_bytes())
