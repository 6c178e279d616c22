"""The link panel, and what the page does while the link is slow or dead."""

from __future__ import annotations

import re
import socket
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from playwright.sync_api import Browser, expect

from farhand.common.impairment.link_control import RelayControl
from farhand.evaluation.harness.farhand_process import ReadyProcess
from tests.browser.desk_page import page_of
from tests.browser.operator_page import WAIT_MS, OperatorPage

HOST = "127.0.0.1"


def test_the_delay_slider_changes_the_age_of_the_data_at_once(tab: OperatorPage) -> None:
    expect(tab.page.get_by_text("Link (simulated)")).to_be_attached(timeout=WAIT_MS)
    tab.slide("One-way delay [ms]", 500)
    tab.says("age", re.compile(r"^(0\.[5-9]|[1-9])"))
    tab.slide("One-way delay [ms]", 0)
    tab.says("age", re.compile(r"^0\.[0-3]"))


def test_a_profile_is_taken_as_a_whole(tab: OperatorPage) -> None:
    choose(tab, "geo")
    expect(tab.slider("One-way delay [ms]")).to_have_value("300", timeout=WAIT_MS)
    expect(tab.slider("Jitter [ms]")).to_have_value("20", timeout=WAIT_MS)
    tab.says("age", re.compile(r"^0\.[3-9]"))
    choose(tab, "lan")
    tab.says("age", re.compile(r"^0\.[0-2]"))


def test_a_link_that_dies_and_comes_back_interrupts_neither_the_robot_nor_the_operator(
    tab: OperatorPage,
) -> None:
    tab.taught()
    tab.command("Arm", "HOLD")
    tab.command("Execute", "AUTONOMOUS")
    popups = tab.page.locator("[role=dialog]:visible, .mantine-Notification-root:visible")
    with tab.cut_link():
        tab.says("silence", re.compile(r"silent for \d+ s"))
        tab.says("mode", "AUTONOMOUS")
        expect(tab.tp("seen")).to_contain_text("OLD", timeout=WAIT_MS)
        expect(popups).to_have_count(0)
    tab.says("link", "OK")
    tab.says("phase", "ARRIVED")
    expect(popups).to_have_count(0)
    tab.command("Abort", "HOLD")


def test_loss_and_a_change_of_ports_are_offered_over_datagrams_and_a_tcp_connection_is_said_to_lose_nothing(
    browser: Browser, tmp_path: Path
) -> None:
    with socket.create_server((HOST, 0)) as robot:
        link = ReadyProcess(
            "link", f"--listen={HOST}:0", f"--target={HOST}:{robot.getsockname()[1]}", f"--control={HOST}:0",
            "--profile=lan",
        )  # fmt: skip
        control, data = RelayControl(HOST, link.ready["control_port"]), (HOST, link.ready["port"])
        try:
            with page_of(tmp_path, control=control) as (_it, page):
                tab = OperatorPage(browser.new_page())
                tab.goto(page.address)
                with socket.create_connection(data):
                    tab.says("loss", re.compile("TCP connection loses no packets"))
                    expect(tab.slider("Loss [%]")).to_have_count(0)
                    tab.not_offered("Change ports")
                with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
                    sender.sendto(b"to the robot", data)
                    tab.slide("Loss [%]", 10)
                    lost = await_status(control, lambda status: status["settings"]["uplink"]["loss"] == 10.0)
                    assert lost["settings"]["downlink"]["loss"] == 10.0
                    tab.says("loss", "")
                    tab.press("Change ports")
                    await_status(control, lambda status: status["rebinds"] == 1)
                    expect(tab.slider("Loss [%]")).to_have_value("10", timeout=WAIT_MS)
                    tab.says("too-slow", "")
                    control.profile("acoustic")  # as any other program may, too
                    tab.says(
                        "too-slow", re.compile("^This link carries 9600 bit/s and the sites were told more")
                    )
                tab.page.context.close()
                assert tab.problems == []
        finally:
            link.kill()


def await_status(control: RelayControl, holds: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
    """Ask the link process until its status is as wanted."""
    end_s = time.monotonic() + WAIT_MS / 1e3
    while not holds(status := control.status()):
        assert time.monotonic() < end_s, status
    return status


def choose(tab: OperatorPage, profile: str) -> None:
    tab.pick("Profile", tab.page.get_by_role("option", name=profile, exact=True))
