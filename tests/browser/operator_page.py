"""The operator's page as a test drives it: what it says by `[data-tp=…]`, its buttons, its two boards."""

from __future__ import annotations

import re
import shutil
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress

from playwright.sync_api import Browser, Locator, Page, Playwright, expect
from playwright.sync_api import TimeoutError as PlaywrightTimeout

from farhand.local_site.view.scene.board.boards import board_origin_m, view_of
from tests.browser.board_picture import await_boards

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
WAIT_MS = 60_000.0
"""A generous deadline for an event, never a speed that is tested [ms]."""
expect.set_options(timeout=WAIT_MS)
BOARD_M = (1.0, 1.0)

Point = tuple[float, float]
Points = Sequence[Point]


def launch(playwright: Playwright, *arguments: str) -> Browser:
    """The system's Chromium, which draws in software."""
    return playwright.chromium.launch(
        executable_path=CHROMIUM, headless=True, args=["--no-sandbox", *arguments]
    )


class OperatorPage:
    """One tab of the operator's page.

    Args:
        page: The tab.
    """

    def __init__(self, page: Page):
        self.page = page
        self.problems: list[str] = []
        """Errors of the page's scripts."""
        self.console: list[str] = []
        self.requests: list[str] = []
        page.set_default_timeout(WAIT_MS)
        page.add_init_script("try { localStorage.setItem('farhand-tour', 'seen'); } catch { }")
        page.on("pageerror", lambda error: self.problems.append(str(error)))
        page.on("console", lambda message: self.console.append(message.text))
        page.on("request", lambda request: self.requests.append(request.url))

    def open(self, address: str, dpr: float = 0.25) -> None:
        """Load the page and wait until it is all there; coarse pixels are drawn faster."""
        self.goto(address, dpr)
        self.settle()

    def goto(self, address: str, dpr: float = 0.25) -> None:
        """Load the page and wait until it shows the robot's mode."""
        self.page.goto(f"{address}?fixedDpr={dpr}")
        self.says("mode", re.compile("^(?!UNKNOWN$)."))

    def settle(self) -> None:
        """Wait until the page shows the robot's mode and its own role, and the scene is drawn in place."""
        self.says("mode", re.compile("^(?!UNKNOWN$)."))
        expect(self.tp("session")).to_have_text(re.compile("."), timeout=WAIT_MS)
        expect(self.canvas).to_be_visible(timeout=WAIT_MS)
        self.await_scene()

    def await_scene(self) -> None:
        """Wait until the boards are drawn in place."""
        await_boards(self)

    # What it says -------------------------------------------------------------------------------

    def tp(self, name: str) -> Locator:
        """What the page says under a name."""
        return self.page.locator(f"[data-tp={name}]")

    def says(self, name: str, words: str | re.Pattern[str]) -> None:
        """Wait until the page says this under a name."""
        expect(self.tp(name)).to_have_text(words, timeout=WAIT_MS)

    def tells(self, words: str | re.Pattern[str]) -> None:
        """Wait until a message says this."""
        expect(self.tp("message").filter(has_text=words).first).to_be_attached(timeout=WAIT_MS)

    def advises(self, words: str) -> None:
        """Wait until the advice on the next step names this."""
        expect(self.tp("advice")).to_contain_text(words, timeout=WAIT_MS)

    def number(self, name: str) -> float:
        """The number under a name."""
        found = re.search(r"[\d.]+", self.tp(name).inner_text())
        assert found, f"{name} shows no number"
        return float(found[0])

    # Buttons and sliders ------------------------------------------------------------------------

    def button(self, label: str) -> Locator:
        """A button by its label, on the action line or in the drawer, whether that is open or not."""
        return self.page.locator("button:not(.fh-own)").filter(has_text=re.compile(f"^{re.escape(label)}$"))

    @contextmanager
    def reachable(self, it: Locator, within_ms: float = WAIT_MS) -> Iterator[None]:
        """Open the drawer if that is where it is, and close it again."""
        expect(it).to_be_attached(timeout=within_ms)
        hidden = not it.is_visible()
        if hidden:
            self.page.locator("#fh-menu").click()
        try:
            yield
        finally:
            if hidden:
                self.page.locator("#fh-menu").click()

    def press(self, label: str, within_ms: float = WAIT_MS) -> None:
        """Press a button once it may be pressed."""
        if label == "STOP":
            self.page.locator("#fh-stop").click()
            return
        button, give_up_s = self.button(label), time.monotonic() + within_ms / 1000.0
        while True:
            left_ms = 1000.0 * (give_up_s - time.monotonic())
            try:
                with self.reachable(button, max(1.0, left_ms)):
                    button.click(timeout=max(1.0, min(left_ms, WAIT_MS / 6.0)))
                    return
            except PlaywrightTimeout:  # it may have moved between the action line and the drawer
                if left_ms <= 0.0:
                    raise

    @contextmanager
    def cut_link(self) -> Iterator[None]:
        """Cut the link until the end of the block: a number of seconds would be over too soon on a busy machine."""
        self.slide("Cut for [s]", 60)
        self.press("Cut")
        self.says("link", "LOST")
        yield
        self.slide("Cut for [s]", 1)  # in place of the present cut
        self.press("Cut")

    def command(self, label: str, mode: str) -> None:
        """Press a button until the robot reports the mode that it leads to."""
        self.insist(label, "mode", mode)

    def insist(self, label: str, name: str, words: str | re.Pattern[str], last_ms: float = WAIT_MS) -> None:
        """Press a button until the page says this: on a busy machine a command may come too late, and is refused.

        Args:
            label: Of the button.
            name: What says it.
            words: What it says.
            last_ms: How long to wait for that after the last press.
        """
        for _ in range(4):
            with suppress(
                PlaywrightTimeout, AssertionError
            ):  # the button of what is not possible any more is gone
                if label == "STOP" or (
                    self.button(label).count() and self.button(label).is_enabled(timeout=WAIT_MS / 6.0)
                ):
                    self.press(label, WAIT_MS / 6.0)
            with suppress(AssertionError):
                expect(self.tp(name)).to_have_text(words, timeout=WAIT_MS / 6.0)
                return
        expect(self.tp(name)).to_have_text(words, timeout=last_ms)

    def pick(self, label: str, option: Locator) -> None:
        """Pick an option of a list in the drawer."""
        chosen = self.page.get_by_role("combobox", name=label, include_hidden=True)
        with self.reachable(chosen):
            chosen.click()
            option.click()

    def not_offered(self, label: str) -> None:
        """Wait until a button is drawn nowhere: its action is impossible now."""
        expect(self.button(label)).to_have_count(0, timeout=WAIT_MS)

    def choose_task(self, name: str) -> None:
        """Have everything be about another task."""
        self.page.get_by_role("combobox", name="Task").click()
        self.page.get_by_role("option", name=name, exact=True).click()
        self.says("task", name)

    def slider(self, label: str) -> Locator:
        """The number beside a slider."""
        own = f'xpath=//p[normalize-space()="{label}"]/following::input[not(@type="hidden")]'
        return self.page.locator(own).first

    def slide(self, label: str, value: float) -> None:
        """Type a slider's value."""
        with self.reachable(self.slider(label)):
            self.slider(label).fill(f"{value:g}")
            self.slider(label).press("Enter")

    def disarmed(self) -> None:
        """Bring the robot to DISARMED, whatever it does."""
        if self.tp("mode").inner_text() != "DISARMED":
            self.command("STOP", "STOPPED")
            self.command("Reset", "DISARMED")

    def taught(self) -> None:
        """See to it that the robot has a model."""
        if self.number("demos") == 0:
            self.press("Load samples")
        self.says("demos", re.compile("[1-9]"))
        if "robot has it" not in self.tp("model").inner_text():
            self.press("Send model")
        self.says("model", re.compile("robot has it"))

    @contextmanager
    def key_held(self, key: str) -> Iterator[None]:
        """Hold a key down until the end of the block."""
        self.page.keyboard.down(key)
        try:
            yield
        finally:
            self.page.keyboard.up(key)

    # The boards ---------------------------------------------------------------------------------

    @property
    def canvas(self) -> Locator:
        """Where the boards are drawn."""
        return self.page.locator("canvas[data-engine]")

    def pixel(self, at_m: Point, remote: bool = False) -> Point:
        """Where a point of a board is on the page [px]."""
        box = self.canvas.bounding_box()
        assert box is not None
        x, y = board_origin_m(remote, BOARD_M[0])
        across, down = view_of(BOARD_M, (box["width"], box["height"])).pixel(at_m[0] + x, at_m[1] + y)
        return box["x"] + across, box["y"] + down

    def draw(self, points: Points, remote: bool = False) -> None:
        """Drag along these points of a board [m]."""
        with self.hold(points, remote):
            pass

    def draw_until(self, fault: Callable[[], object]) -> None:
        """Look again whenever the browser has drawn, until there is no fault; at the deadline the last one is told."""
        give_up_s = time.monotonic() + WAIT_MS / 1e3
        while found := fault():
            assert time.monotonic() < give_up_s, found
            self.next_frame()

    def next_frame(self) -> None:
        """Wait until the browser draws again."""
        self.page.evaluate("() => new Promise(requestAnimationFrame)")

    def frames(self, n: int) -> None:
        """Wait until the browser has drawn so many times."""
        for _ in range(n):
            self.next_frame()

    @contextmanager
    def hold(self, points: Points, remote: bool = False) -> Iterator[None]:
        """Drag along these points [m] and keep the mouse's button down until the end of the block."""
        mouse = self.page.mouse
        mouse.move(*self.pixel(points[0], remote))
        self.next_frame()  # what is under the mouse is found when the page draws
        mouse.down()
        self.next_frame()
        for point in points[1:]:
            mouse.move(*self.pixel(point, remote))
        try:
            yield
        finally:
            mouse.up()
