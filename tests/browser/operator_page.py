"""The operator's page as a test drives it: what it says by `[data-tp=…]`, its buttons, its two boards."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from playwright.sync_api import Browser, Locator, Page, Playwright, expect

from local_site.view.camera import board_origin_m, view_of

WAIT_MS = 30_000.0
"""A generous deadline for an event, not a speed that is tested [ms]."""
SIZE_PX = (900, 560)

Points = Sequence[tuple[float, float]]


def launch(playwright: Playwright) -> Browser:
    """The system's Chromium, which draws in software."""
    return playwright.chromium.launch(
        executable_path="/usr/bin/chromium", headless=True, args=["--no-sandbox"]
    )


class OperatorPage:
    """One tab of the operator's page.

    Args:
        page: The tab.
        board_m: Width and height of a board [m].
    """

    def __init__(self, page: Page, board_m: tuple[float, float] = (1.0, 1.0)):
        self.page, self._board_m = page, board_m
        self.problems: list[str] = []
        self.foreign: list[str] = []

    def open(self, address: str, query: str = "?fixedDpr=0.25") -> None:
        """Load the page and wait until it shows what the robot reported."""
        self.page.on("pageerror", lambda error: self.problems.append(str(error)))
        self.page.on(
            "request",
            lambda request: (
                None
                if request.url.startswith((address, "blob:", "data:"))
                else self.foreign.append(request.url)
            ),
        )
        toast = self.page.locator(".mantine-Notification-root", has_text="Software WebGL")
        self.page.add_locator_handler(toast, lambda shown: shown.locator("button").click())
        self.page.goto(address + query)
        self.settle()

    def settle(self) -> None:
        """Wait until the page shows a mode and the canvas is there."""
        expect(self.tp("mode")).to_have_text(re.compile("^(?!UNKNOWN)"), timeout=WAIT_MS)
        expect(self.page.locator("canvas[data-engine]")).to_be_visible(timeout=WAIT_MS)

    def tp(self, name: str) -> Locator:
        """What the page says under a name."""
        return self.page.locator(f"[data-tp={name}]")

    def says(self, name: str, words: str | re.Pattern[str], timeout_ms: float = WAIT_MS) -> None:
        """Wait until the page says this under a name."""
        expect(self.tp(name)).to_have_text(words, timeout=timeout_ms)

    def number(self, name: str) -> float:
        """The number under a name."""
        found = re.search(r"[\d.]+", self.tp(name).inner_text())
        assert found, f"{name} shows no number"
        return float(found[0])

    def button(self, label: str) -> Locator:
        """A button by its label."""
        return self.page.get_by_role("button", name=label, exact=True)

    def press(self, label: str) -> None:
        """Press a button once it may be pressed."""
        self.button(label).click(timeout=WAIT_MS)

    # The boards ---------------------------------------------------------------------------------

    def pixel(self, at_m: tuple[float, float], remote: bool = False) -> tuple[float, float]:
        """Where a point of a board is on the page [px]."""
        box = self.page.locator("canvas[data-engine]").bounding_box()
        assert box is not None
        x, y = board_origin_m(remote, self._board_m[0])
        view = view_of(self._board_m, (box["width"], box["height"]))
        across, down = view.pixel(at_m[0] + x, at_m[1] + y)
        return box["x"] + across, box["y"] + down

    def draw(self, points: Points, remote: bool = False) -> None:
        """Drag along these points of a board [m]."""
        with self.hold(points, remote):
            pass

    @contextmanager
    def hold(self, points: Points, remote: bool = False) -> Iterator[None]:
        """Drag along these points [m] and keep the mouse's button down until the end of the block."""
        mouse = self.page.mouse
        mouse.move(*self.pixel(points[0], remote))
        mouse.down()
        for point in points[1:]:
            mouse.move(*self.pixel(point, remote))
        try:
            yield
        finally:
            mouse.up()
