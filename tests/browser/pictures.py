"""Takes the pictures of the operator's guide: `make pictures`. They show what the browser tests drive."""

from __future__ import annotations

import io
import re
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

from PIL import Image
from playwright.sync_api import Browser, Page, expect, sync_playwright

from tests.browser import arm_pictures
from tests.browser.arm_page import BAXTER, ArmPage, BaxterPage
from tests.browser.operator_page import CHROMIUM, WAIT_MS, OperatorPage, launch
from tests.browser.stack import farhand_up, slow_task
from tests.browser.test_layout import TO_THE_TOP

FOLDER = Path(__file__).parents[2] / "docs" / "pictures"
SMALL, LARGE = (1280, 720), (1920, 1080)
_COLOURS = 128
_FRAMES = 12
STROKE = [(0.14 + 0.58 * k / 24, 0.30 + 0.75 * (k / 24) - 0.80 * (k / 24) ** 2) for k in range(25)]

Take = Callable[[str], None]


def main() -> int:
    """Take all of them, or those of the kinds of tasks that are named: arm, baxter, board.

    Returns:
        The exit status.
    """
    if CHROMIUM is None:
        sys.stderr.write("pictures: no Chromium on this machine (Debian: apt-get install chromium)\n")
        return 1
    FOLDER.mkdir(parents=True, exist_ok=True)
    kinds = {"arm": take_arm, "baxter": take_baxter, "board": take_board}
    with sync_playwright() as playwright:
        browser = launch(playwright)
        for kind in sys.argv[1:] or kinds:
            kinds[kind](browser)
        browser.close()
    return 0


def take_arm(browser: Browser) -> None:
    """The pictures of the arm's task."""
    with (
        tempfile.TemporaryDirectory() as scratch,
        farhand_up(Path(scratch), link="geo", task="hot-stab,hot-stab-removal") as stack,
    ):
        tab = ArmPage(_page(browser, *LARGE))
        tab.open(stack.address, dpr=1.0)
        arm_pictures.play(tab, lambda name: take_both(tab, name))
        tab.page.context.close()


def take_baxter(browser: Browser) -> None:
    """The paper's own set-up, seated."""
    with (
        tempfile.TemporaryDirectory() as scratch,
        farhand_up(Path(scratch), "lan", "hot-stab", *BAXTER) as stack,
    ):
        tab = BaxterPage(_page(browser, *SMALL))
        tab.open(stack.address, dpr=1.0)
        tab.press("Load samples")
        tab.says("demos", "5")
        tab.execute_until_seated()
        take(tab, "baxter", few_colours=False)
        tab.page.context.close()


def take_both(tab: OperatorPage, name: str) -> None:
    """A shaded picture in the large window, and one in the small."""
    take(tab, name, few_colours=False)
    if name == "arm-link-cut":  # the outage is over before the second picture
        return
    tab.page.set_viewport_size({"width": SMALL[0], "height": SMALL[1]})
    tab.frames(_FRAMES)  # until the camera is fitted into it, whatever the view is
    take(tab, f"{name}-{SMALL[1]}", few_colours=False)
    tab.page.set_viewport_size({"width": LARGE[0], "height": LARGE[1]})
    tab.frames(_FRAMES)


def take_board(browser: Browser) -> None:
    """The pictures of the planar task, in two sizes."""
    for size, suffix in ((SMALL, ""), (LARGE, f"-{LARGE[1]}")):
        with tempfile.TemporaryDirectory() as scratch:
            folder = Path(scratch)
            with farhand_up(folder / "data", link="geo", task=slow_task(folder)) as stack:
                tab = OperatorPage(_page(browser, *size))
                tab.open(stack.address, dpr=1.0)
                play(tab, lambda name, tab=tab, suffix=suffix: take(tab, name + suffix))
                tab.page.context.close()


def _page(browser: Browser, width: int, height: int) -> Page:
    return browser.new_context(viewport={"width": width, "height": height}).new_page()


def play(tab: OperatorPage, shoot: Take) -> None:
    """Do the whole job, a picture of each state."""
    shoot("start")
    tab.press("Record")
    tab.says("recording", "RECORDING")
    with tab.hold(STROKE[:18]):
        tab.says("components", re.compile("[1-9]"))
        shoot("recording")
    tab.press("Undo")
    tab.says("recording", "")
    tab.taught()
    tab.command("Arm", "HOLD")
    tab.press("Preview")
    tab.tells(re.compile("previewed .* s of motion"))
    shoot("preview")
    tab.command("Couple", "DIRECT")
    with tab.hold([(0.20 + 0.01 * k, 0.30) for k in range(15)]):
        shoot("driving")
    tab.says("mode", "HOLD")
    tab.says("pending", "none")
    tab.command("Execute", "AUTONOMOUS")
    expect(tab.page.locator(".fh-remote")).to_contain_text("to go", timeout=WAIT_MS)
    shoot("executing")
    tab.slide("Cut for [s]", 60)
    tab.press("Cut")
    tab.says("link", "LOST")
    shoot("link-lost")
    tab.press("STOP")
    tab.says("stop", re.compile("STOP NOT DELIVERED"))
    shoot("stop-not-delivered")


def take(tab: OperatorPage, name: str, few_colours: bool = True) -> None:
    """One picture, small: few colours do for flat boards, not for what is shaded."""
    tab.page.evaluate(TO_THE_TOP)
    tab.next_frame()
    picture = Image.open(io.BytesIO(tab.page.screenshot(timeout=2.0 * WAIT_MS))).convert("RGB")
    if few_colours:
        picture = picture.quantize(_COLOURS, dither=Image.Dither.NONE)
    picture.save(FOLDER / f"{name}.png", optimize=True)
    sys.stderr.write(f"pictures: {FOLDER / name}.png\n")


if __name__ == "__main__":
    sys.exit(main())
