"""The page can be read by everybody: no two texts overlap, nothing is cut off, and axe-core finds nothing serious."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from axe_playwright_python.sync_playwright import Axe

from tests.browser.operator_page import OperatorPage

SIZES = [(1280, 720), (1920, 1080)]
SMALL_SIZES = [(1024, 600), (768, 1024), (390, 844)]
_NARROW_PX = 700
"""Below this width the page shows less, see `test_small_windows`."""

# The boxes of all lines of text that are to be seen, as far as nothing scrolls them away: {owner, text, x, y, right, bottom, fault}.
# A fault is a line that is cut off, wider than the box that is drawn around it, or under another box.
TEXT_BOXES = """() => {
  const ALL_HIT = document.head.appendChild(document.createElement("style"));
  ALL_HIT.textContent = "* { pointer-events: auto !important }";  // else what is drawn without taking clicks would not be found
  const boxes = [], owners = [], styles = new Map();
  const styleOf = (element) => styles.get(element) ?? styles.set(element, getComputedStyle(element)).get(element);
  const opaque = (element) => element.checkVisibility({ opacityProperty: true, visibilityProperty: true })
    && (element.matches("img, canvas") || styleOf(element).backgroundColor !== "rgba(0, 0, 0, 0)");
  const scrolls = (value) => value === "auto" || value === "scroll";
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  for (let node = walker.nextNode(); node; node = walker.nextNode()) {
    const text = node.textContent.trim(), owner = node.parentElement;
    if (!text || owner.closest("style, script, noscript, [data-portal]")) continue;
    if (!owner.checkVisibility({ opacityProperty: true, visibilityProperty: true })) continue;
    const range = document.createRange();
    range.selectNodeContents(node);
    if (!owners.includes(owner)) owners.push(owner);
    for (const line of range.getClientRects()) {
      let { x, y, right, bottom } = line, fault = "";
      if (line.width < 1 || line.height < 1) continue;
      for (let at = owner; at && at !== document.body; at = styleOf(at).position === "fixed" ? null : at.parentElement) {
        const style = styleOf(at), around = at.getBoundingClientRect();
        if (style.display === "inline" || style.display === "contents") continue;
        const filled = style.backgroundColor !== "rgba(0, 0, 0, 0)" || parseFloat(style.borderLeftWidth) > 0;
        const clipped = style.overflowX !== "visible" && !scrolls(style.overflowX);
        if ((clipped || filled) && line.right > around.right + 1) fault = clipped ? "cut" : "wider than its box";
        if (style.overflowY !== "visible" || scrolls(style.overflowX)) {
          x = Math.max(x, around.x); y = Math.max(y, around.y);
          right = Math.min(right, around.right); bottom = Math.min(bottom, around.bottom);
        }
      }
      if (right - x < 1 || bottom - y < 0.6 * line.height) continue;
      const svg = owner.closest("svg"), scene = owner.closest("[data-dock-root] > div:has(canvas[data-engine])");
      const own = (hit) => hit.contains(owner) || owner.contains(hit) || svg?.contains(hit);
      const topmost = (across) => document.elementsFromPoint(across, (y + bottom) / 2).find((hit) => own(hit) || opaque(hit));
      const over = [x + 2, (x + right) / 2, right - 2].map(topmost).find((hit) => hit && !own(hit));
      if (over && !scene) fault = `under ${over.id || over.className || over.tagName}: ${over.textContent.slice(0, 40)}`;
      boxes.push({ owner: owners.indexOf(owner), text, x, y, right, bottom, fault });
    }
  }
  for (const picture of document.querySelectorAll(".fh-camera img")) {
    if (!picture.checkVisibility()) continue;
    const { x, y, right, bottom } = picture.getBoundingClientRect(), part = picture.parentElement.className.split(" ")[0];
    const own = (hit) => hit.contains(picture) || hit.closest(`.${part}`);
    const corners = [[x + 2, y + 2], [right - 2, y + 2], [x + 2, bottom - 2], [right - 2, bottom - 2]];
    const topmost = ([across, down]) => document.elementsFromPoint(across, down).find((hit) => own(hit) || opaque(hit));
    const over = corners.map(topmost).find((hit) => hit && !own(hit));
    if (over) boxes.push({ owner: -1, text: picture.alt, x, y, right: x, bottom: y, fault: `under ${over.id || over.className}` });
  }
  ALL_HIT.remove();
  return boxes;
}"""

# What a button that was pressed scrolled, so that nothing is below STOP, which stays where it is.
TO_THE_TOP = "() => document.querySelectorAll('*').forEach((element) => { element.scrollTop = 0 })"


def assert_legible(tab: OperatorPage, sizes: Sequence[tuple[int, int]] = SIZES, drawer: bool = False) -> None:
    """In each of the sizes; the window is as before in the end, for who takes hold of something in it.

    What a new mode or size has moved is in place some frames later.

    Args:
        tab: The page.
        sizes: Of the window [px].
        drawer: Whether the drawer is open.
    """
    before = tab.page.viewport_size
    assert before is not None
    for width, height in sizes:
        tab.page.set_viewport_size({"width": width, "height": height})
        tab.page.evaluate(TO_THE_TOP)
        with drawer_open(tab, drawer and width >= _NARROW_PX):
            tab.draw_until(lambda: _faults(tab, width, height))  # noqa: B023 (called at once)
    tab.page.set_viewport_size(before)


@contextmanager
def drawer_open(tab: OperatorPage, wanted: bool) -> Iterator[None]:
    """Open the drawer, and close it again."""
    if wanted:
        tab.page.locator("#fh-menu").click()
    yield
    if wanted:
        tab.page.locator("#fh-menu").click()


def _faults(tab: OperatorPage, width: int, height: int) -> list[object]:
    """Texts that are cut off, hidden or too wide, or lie over others; the count where there are too few."""
    boxes = tab.page.evaluate(TEXT_BOXES)
    few = [] if len(boxes) > (30 if width >= _NARROW_PX else 5) else [len(boxes)]
    found = [*few, *((box["text"], box["fault"]) for box in boxes if box["fault"]), *overlapping(boxes)]
    return [f"at {width} x {height}", *found] if found else []


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
    with drawer_open(tab, True):
        assert_accessible(tab)
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
    with tab.cut_link():
        tab.press("STOP")
        tab.says("pending", "none")
        assert_legible(tab)
        assert_accessible(tab)
    tab.says("mode", "STOPPED")
    assert_legible(tab)
