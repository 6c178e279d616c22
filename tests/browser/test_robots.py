"""Two robots at a hub in a real browser: a page for each, with links to the other, and nothing of one at the other."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import ExitStack

import pytest
from playwright.sync_api import Browser, expect

from farhand.common.address import free_port, listening_fault
from tests.browser.operator_page import WAIT_MS, OperatorPage
from tests.browser.stack import Stack, still_task
from tests.browser.tabs import tabs_of
from tests.farhand_process import running

HOST = "127.0.0.1"


def two_free_ports() -> int:
    """The first of two ports, one after the other."""
    while listening_fault(f"tcp/{HOST}:{(port := free_port()) + 1}"):
        pass
    return port


@pytest.fixture(scope="module")
def consoles(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, Stack]]:
    """The pages of two robots, of one `farhand local`."""
    folder, where, port = tmp_path_factory.mktemp("fleet"), f"tcp/{HOST}:{free_port()}", two_free_ports()
    task = still_task(folder)
    robots = ("rov1", "rov2")
    with ExitStack() as stack:
        stack.enter_context(running("hub", "--listen", where))
        for robot in robots:
            own = ("--vehicle", robot, "--data-dir", folder / robot)
            stack.enter_context(running("remote", "--connect", where, "--task", task, *own))
        options = ("--robots", ",".join(robots), "--port", port, "--site-name", "shore-1")
        data = folder / "shore"
        local = stack.enter_context(
            running("local", "--connect", where, "--task", task, "--data-dir", data, *options)
        )
        for robot in robots:
            local.until(f"{robot} reports")
        yield {
            robot: Stack(local, f"http://{HOST}:{port + k}", data / "robots" / robot)
            for k, robot in enumerate(robots)
        }


def test_each_robot_has_its_own_page_library_and_lease_and_stop_stops_one_alone(
    browser: Browser, consoles: dict[str, Stack]
):
    with tabs_of(browser, OperatorPage, 900, 560) as open_one:
        first, second = open_one(consoles["rov1"]), open_one(consoles["rov2"])
        for page, own, other in ((first, "rov1", "rov2"), (second, "rov2", "rov1")):
            page.says(f"robot-{own}", own)
            page.says(f"robot-{other}", re.compile(f"{other} DISARMED"))
            page.says("lease", "you have control")
        for page in (first, second):
            page.command("Arm", "HOLD")
        first.command("STOP", "STOPPED")
        second.says("robot-rov1", "rov1 STOPPED")
        second.says("mode", "HOLD")
        first.says("robot-rov2", "rov2 HOLD")
        first.press("Load samples")
        first.says("demos", re.compile("[1-9]"))
        second.says("demos", "0")
        assert (consoles["rov1"].data_dir / "planar").exists()
        assert not (consoles["rov2"].data_dir / "planar").exists()


def test_the_row_of_robots_leads_to_the_page_of_another_one(browser: Browser, consoles: dict[str, Stack]):
    with tabs_of(browser, OperatorPage, 900, 560) as open_one:
        page = open_one(consoles["rov1"])
        page.tp("robot-rov2").click()
        expect(page.page).to_have_url(re.compile(re.escape(consoles["rov2"].address)), timeout=WAIT_MS)
        page.settle()
        page.says("robot-rov2", "rov2")
        page.says("robot-rov1", re.compile("rov1 [A-Z]+"))


def test_a_row_fits_beside_the_views_and_the_legend(browser: Browser, consoles: dict[str, Stack]):
    with tabs_of(browser, OperatorPage, 900, 560) as open_one:
        page = open_one(consoles["rov2"])
        page.says("robot-rov1", re.compile("rov1 [A-Z]+"))
        row = page.page.locator(".fh-robots").bounding_box()
        assert row is not None
        for other in (".fh-here-view", ".fh-here-legend"):
            box = page.page.locator(f".mantine-Paper-root[data-with-border]:has({other})").last.bounding_box()
            assert box is not None
            apart = (
                box["x"] + box["width"] <= row["x"]
                or row["x"] + row["width"] <= box["x"]
                or box["y"] + box["height"] <= row["y"]
                or row["y"] + row["height"] <= box["y"]
            )
            assert apart, (other, row, box)
