"""The page can be read by everybody: no two texts overlap, nothing is cut off, and axe-core finds nothing serious."""

from __future__ import annotations

from collections.abc import Sequence

from axe_playwright_python.sync_playwright import Axe

from tests.browser.operator_page import OperatorPage

SIZES = [(1280, 720), (1920, 1080)]
SMALL_SIZES = [(1024, 600), (768, 1024), (390, 844)]
_NARROW_PX = 700
"""Below this width the page shows less, see `test_small_windows`."""

# The boxes of all lines of text that are to be seen: {owner, text, x, y, right, bottom, cut}.
TEXT_BOXES = """() => {
  const boxes = [], owners = [];
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  for (let node = walker.nextNode(); node; node = walker.nextNode()) {
    const text = node.textContent.trim(), owner = node.parentElement;
    if (!text || owner.closest("style, script, noscript, [data-portal]")) continue;
    if (!owner.checkVisibility({ opacityProperty: true, visibilityProperty: true })) continue;
    const range = document.createRange();
    range.selectNodeContents(node);
    if (!owners.includes(owner)) owners.push(owner);
    for (const { x, y, right, bottom, width, height } of range.getClientRects()) {
      if (width < 1 || height < 1) continue;
      let cut = false;
      for (let at = owner; at; at = getComputedStyle(at).position === "fixed" ? null : at.parentElement) {
        const clips = getComputedStyle(at).overflowX !== "visible";
        if (clips && right > at.getBoundingClientRect().right + 1) cut = true;
      }
      boxes.push({ owner: owners.indexOf(owner), text, x, y, right, bottom, cut });
    }
  }
  return boxes;
}"""

# What a button that was pressed scrolled, so that nothing is below STOP, which stays where it is.
_FRAMES = 200
TO_THE_TOP = "() => document.querySelectorAll('*').forEach((element) => { element.scrollTop = 0 })"


def assert_legible(tab: OperatorPage, sizes: Sequence[tuple[int, int]] = SIZES) -> None:
    """In each of the sizes; the window is as before in the end, for who takes hold of something in it."""
    before = tab.page.viewport_size
    assert before is not None
    for width, height in sizes:
        tab.page.set_viewport_size({"width": width, "height": height})
        tab.page.evaluate(TO_THE_TOP)
        faults = _faults(tab, width)
        for _ in range(_FRAMES):  # what a new mode or size has moved is in place some frames later
            if not faults:
                break
            tab.next_frame()
            faults = _faults(tab, width)
        assert not faults, f"at {width} x {height}"
    tab.page.set_viewport_size(before)


def _faults(tab: OperatorPage, width: int) -> list[object]:
    """Texts that are cut off or lie over others; the count where there are too few."""
    boxes = tab.page.evaluate(TEXT_BOXES)
    few = [] if len(boxes) > (30 if width >= _NARROW_PX else 5) else [len(boxes)]
    return [*few, *(box["text"] for box in boxes if box["cut"]), *overlapping(boxes)]


def assert_accessible(tab: OperatorPage) -> None:
    """Names, roles, contrast, keyboard: by axe-core, in the window's present size."""
    found = Axe().run(tab.page).response["violations"]
    serious = [rule for rule in found if rule["impact"] in ("serious", "critical")]
    assert [(rule["help"], [node["html"] for node in rule["nodes"]]) for rule in serious] == []


def overlapping(boxes: list[dict]) -> list[tuple[str, str]]:
    """Pairs of texts of different elements whose boxes share more than a pixel either way."""
    return [
        (a["text"], b["text"])
        for i, a in enumerate(boxes)
        for b in boxes[i + 1 :]
        if a["owner"] != b["owner"]
        and min(a["right"], b["right"]) - max(a["x"], b["x"]) > 1.0
        and min(a["bottom"], b["bottom"]) - max(a["y"], b["y"]) > 1.0
    ]


def test_the_overlap_is_found() -> None:
    box = {"owner": 0, "text": "a", "x": 0, "y": 0, "right": 10, "bottom": 10}
    beside = {**box, "owner": 1, "text": "b", "x": 10, "right": 20}
    over = {**box, "owner": 2, "text": "c", "x": 5, "y": 5}
    assert overlapping([box, beside]) == []
    assert overlapping([box, over]) == [("a", "c")]


def test_every_state_is_legible_and_accessible(tab: OperatorPage) -> None:
    assert_legible(tab)
    tab.page.locator("#fh-menu").click()
    assert_accessible(tab)
    tab.page.locator("#fh-menu").click()
    tab.taught()
    tab.press("Record")
    tab.says("recording", "RECORDING")
    assert_legible(tab)
    assert_accessible(tab)
    tab.press("Undo")
    tab.command("Arm", "HOLD")
    tab.press("Preview")
    tab.tells("of motion")
    tab.command("Execute", "AUTONOMOUS")
    tab.says("phase", "ARRIVED")
    assert_legible(tab)
    assert_accessible(tab)
    tab.slide("Cut for [s]", 12)
    tab.press("Cut")
    tab.says("link", "LOST")
    tab.press("STOP")
    tab.says("pending", "none")
    assert_legible(tab)
    assert_accessible(tab)
    tab.says("mode", "STOPPED")
    assert_legible(tab)
