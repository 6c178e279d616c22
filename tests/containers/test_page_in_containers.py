"""An operator's work through the published page: both sites and the link in containers, a browser on the host."""

from __future__ import annotations

import re
from contextlib import suppress
from datetime import datetime, timedelta, timezone

import pytest
from playwright.sync_api import TimeoutError as PlaywrightTimeout
from playwright.sync_api import expect

from farhand.deploy.status import HEALTHY
from farhand.local_site.workcell.held_arm import HeldArm
from tests.browser.arm_page import DEEP, ArmPage
from tests.browser.operator_page import WAIT_MS
from tests.cells import JACO
from tests.containers.engine import BUILD_S, RUN_S
from tests.containers.place import SERVICES, Place

pytestmark = [pytest.mark.containers, pytest.mark.timeout(BUILD_S + RUN_S)]

MOVED = "before => Math.abs(parseFloat(document.querySelector('[data-tp=depth]').textContent) - before) > 10"
"""Whether the robot is more than 10 mm from where it was."""


def test_every_container_is_healthy_and_says_so(place: Place) -> None:
    for service in SERVICES:
        place.await_troubles(service, set())
        status, answer = place.status(service, f"--of={service}")
        assert status == HEALTHY
        assert [process["role"] for process in answer["processes"]] == [service]
    assert place.status("operator")[1]["processes"][0]["status"]["facts"]["round_trip_s"] >= 0.56


def test_the_link_loads_no_compiler(place: Place) -> None:
    assert "llvmlite" in place.run("robot", "sh", "-c", "cat /proc/[0-9]*/maps")
    assert "llvmlite" not in place.run("link", "sh", "-c", "cat /proc/[0-9]*/maps")


def test_an_operator_couples_drives_and_clutches(tab: ArmPage) -> None:
    tab.command("Arm", "HOLD")
    arm, before_mm = HeldArm("insert", JACO, tab.seed).view(), tab.number("depth")
    for _ in range(4):  # a browser that is busy drawing may take longer than the robot waits for a hand
        tab.insist("Both", "mode", "HOLD")
        tab.insist("Couple", "mode", "DIRECT")
        with (
            tab.hold_arrow(arm.tip, axis=2, length_m=0.05, n_moves=4, view_reset=True),
            suppress(PlaywrightTimeout),
        ):
            tab.page.wait_for_function(MOVED, arg=before_mm, timeout=WAIT_MS / 4.0)
            break
        tab.says("mode", "HOLD")  # without a hand for ten seconds
    else:
        raise AssertionError(f"the robot could not be driven: {tab.tp('message').all_inner_texts()}")
    tab.insist("Clutch", "mode", "HOLD")  # unless it is clutched because no hand was heard
    tab.insist("Couple", "mode", "DIRECT")
    tab.insist("Clutch", "mode", "HOLD")
    tab.tells("clutch: done")


def test_an_operator_seats_the_plug_by_clicks(place: Place, tab: ArmPage) -> None:
    tab.press("Load samples")
    tab.says("demos", "5")
    tab.press("Send model")
    tab.says("model", re.compile("robot has it"))
    tab.seat()


def test_all_of_it_was_done_with_the_kernels_of_the_image(place: Place) -> None:
    """Nothing was compiled: no kernel lies anywhere but in the image, which cannot be written."""
    for service in SERVICES:
        assert place.run(service, "find", "/tmp", "/data", "-name", "*.nbi") == ""
        assert "compiled functions" not in place.engine.words_of(service)
    assert place.run("robot", "find", "/var/cache/farhand", "-name", "*.nbi") != ""


def test_the_times_are_those_of_the_viewer(tab: ArmPage) -> None:
    shown = tab.tp("message").locator("time").first
    expect(shown).to_have_text(re.compile("^..:..:..$"), timeout=WAIT_MS)
    at = datetime.fromisoformat(shown.get_attribute("datetime") or "")
    assert shown.inner_text() == f"{at.astimezone(timezone(timedelta(hours=9))):%H:%M:%S}"  # in Tokyo


def test_what_a_cut_link_does_to_the_page_and_that_it_comes_back(place: Place, tab: ArmPage) -> None:
    tab.slide("Cut for [s]", 12)
    tab.press("Cut")
    tab.says("link", "LOST")
    place.await_troubles("operator", {"link-cut"})
    tab.says("link", "OK")
    tab.says("phase", "SEATED")  # it has held its place meanwhile
    tab.says("depth", DEEP)
    for service in SERVICES:
        place.await_troubles(service, set())


def test_an_operator_stops_the_robot(tab: ArmPage) -> None:
    tab.command("STOP", "STOPPED")
    tab.command("Reset", "DISARMED")
