"""Each container paused, crashed, restarted and disconnected while the robot inserts its plug or is driven, seen on the page.

What befalls the link or the operator does not end an insertion, and ends driving; the page says that something is wrong, and is
right again without being loaded again.
"""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest
from playwright.sync_api import expect

from farhand.local_site.script.scripted_actions import RealTime
from tests.browser.arm_page import DEEP, ArmPage
from tests.browser.operator_page import WAIT_MS
from tests.containers.engine import BUILD_S, RUN_S, STALLED
from tests.containers.place import SERVICES, Place

pytestmark = [pytest.mark.containers, pytest.mark.soak, pytest.mark.timeout(BUILD_S + 3 * RUN_S)]

_FAULT_S = 5.0
# The network over which a container's data goes, and its name there.
_NETWORK = {"robot": ("subsea", "robot"), "link": ("shore", "link-shore"), "operator": ("shore", "operator")}
_WATCH = """() => {
  window.fhObserver?.disconnect();
  window.fhTrouble = false;
  let heard = -1;
  window.fhObserver = new MutationObserver(() => {
    const beat = Number(document.querySelector('[data-tp=beat]')?.textContent ?? heard);
    window.fhTrouble ||= beat < heard || document.querySelector('[data-tp=link]')?.textContent === 'LOST'
      || (document.querySelector('[data-tp=stale]')?.textContent ?? '') !== '';
    heard = beat;
  });
  window.fhObserver.observe(document.body, {subtree: true, childList: true, characterData: true});
}"""
"""Notes from now on whether the page says that something is wrong, until it is loaded again; or hears a site that counts from
the beginning: a browser that draws in software may notice silence later than the site is back."""
_BACK_MS = 200_000.0
"""A connection whose other end is gone without a word is given up after two minutes [ms]."""

Shown = Callable[[], object]
"""Waits until the page has said that something is wrong."""


def pause(place: Place, service: str, shown: Shown) -> None:
    container = place.engine.container(service)
    place.engine.do("pause", container)
    shown()
    RealTime().pause(_FAULT_S)
    place.engine.do("unpause", container)


def crash(place: Place, service: str, shown: Shown) -> None:
    """Kill the process and nothing else: the engine starts its container again."""
    pid = place.status(service)[1]["processes"][0]["pid"]
    container = place.engine.container(service)
    place.engine.run(place.engine.docker, "exec", container, "sh", "-c", f"kill -9 {pid}", timeout_s=RUN_S)
    shown()


def restart(place: Place, service: str, shown: Shown) -> None:
    place.engine.do("restart", "--time", "10", place.engine.container(service), timeout_s=RUN_S)
    shown()


def disconnect(place: Place, service: str, shown: Shown) -> None:
    container, (name, alias) = place.engine.container(service), _NETWORK[service]
    network = f"{place.engine.project}_{name}"
    place.engine.do("network", "disconnect", network, container)
    shown()
    RealTime().pause(_FAULT_S)
    place.engine.do("network", "connect", "--alias", alias, network, container)


_FAULTS = (pause, crash, restart, disconnect)
_CASES = [
    (mode, fault, service)
    for service in ("link", "operator", "robot")
    for fault in _FAULTS
    for mode in ("DIRECT", "AUTONOMOUS")
]


def modes_after(mode: str, fault: Callable[..., None], service: str) -> set[str]:
    """The modes that a fault may lead to."""
    if service == "robot" and fault in (crash, restart):
        return {"DISARMED"}
    if service == "robot" and fault is pause:
        return {"STOPPED"}
    return {"AUTONOMOUS"} if mode == "AUTONOMOUS" else {"HOLD"}


@pytest.mark.parametrize(
    ("mode", "fault", "service"),
    _CASES,
    ids=[f"{fault.__name__} {service} in {mode}" for mode, fault, service in _CASES],
)
def test_a_fault_is_shown_and_overcome(
    place: Place, tab: ArmPage, mode: str, fault: Callable[..., None], service: str
) -> None:
    bring_to(tab, mode)
    stalled = tab.tp("message").filter(has_text=STALLED)
    stalled_before = stalled.count()
    tab.page.evaluate(_WATCH)
    # Asked by a timer, not at each drawn frame: a browser that draws in software draws seldom.
    fault(
        place, service,
        lambda: tab.page.wait_for_function("() => window.fhTrouble", timeout=WAIT_MS, polling=200.0),
    )  # fmt: skip
    expect(tab.tp("stale")).to_have_text("", timeout=_BACK_MS)
    expect(tab.tp("link")).to_have_text("OK", timeout=_BACK_MS)
    assert tab.page.evaluate("() => window.fhTrouble"), "the page was loaded again"
    expected = modes_after(mode, fault, service)
    if stalled.count() > stalled_before:
        expected |= {"STOPPED"}  # the machine was busy as well
    tab.says("mode", re.compile("|".join(expected)))
    tab.says("demos", "5")
    if tab.tp("mode").inner_text() != "AUTONOMOUS":
        bring_to(tab, "AUTONOMOUS")  # the job can be done
    tab.says("phase", "SEATED")
    tab.says("depth", DEEP)
    for each in SERVICES:
        place.await_troubles(each, set())


def bring_to(tab: ArmPage, mode: str) -> None:
    """Bring the robot into the operator's hand, or have it begin to insert its plug."""
    if tab.tp("demos").inner_text() != "5":
        tab.press("Load samples")
        tab.says("demos", "5")
    if tab.tp("mode").inner_text() == "STOPPED":
        tab.insist("Reset", "mode", "DISARMED")
    if tab.tp("mode").inner_text() == "DISARMED":
        tab.insist("Arm", "mode", "HOLD")
    if mode == "DIRECT":
        if tab.tp("mode").inner_text() == "AUTONOMOUS":
            tab.insist("Clutch", "mode", "HOLD")
        tab.insist("Couple", "mode", "DIRECT")
        return
    if tab.tp("depth").inner_text().endswith("deep"):
        tab.insist("Retract", "phase", "RETRACTING")
        tab.says("mode", "HOLD")
    tab.insist("Send model", "model", re.compile("robot has it"))
    tab.insist("Preview", "plan", re.compile("^preview: [0-9]+ s left"))
    tab.insist("Execute", "mode", "AUTONOMOUS")
