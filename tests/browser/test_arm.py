"""The arm's task by mouse over a slow link: taught by the arrows at the plug, driven, executed, stopped in the bore.

Whether the robot moved, and how it pressed, is judged by its own reports, heard beside the link.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from playwright.sync_api import Browser, expect

from farhand.common.mode_table import ControlMode
from farhand.common.model.task_frame import TaskFrame
from tests.browser.arm_page import DEEP, ArmPage
from tests.browser.operator_page import WAIT_MS
from tests.browser.robot_record import BESIDE, RobotRecord, recorded, went_m
from tests.browser.stack import Stack, farhand_up, swaying_task
from tests.browser.tabs import tabs_of
from tests.browser.test_layout import assert_accessible, assert_legible

Array = NDArray[np.float64]
NewArmTab = Callable[[Stack], ArmPage]

# In software an arm is drawn slowly: these take minutes on two quiet cores.
pytestmark = [pytest.mark.soak, pytest.mark.timeout(400)]

ASKEW = 3
"""With this seed the operator's plug is 24 degrees askew at first."""
ALIGNED = re.compile(r"\b[01]° askew")
AIMED_MM = 8
"""How far from where it is to be an arrow may leave the plug: the chamfer catches one that is 15 mm beside [mm]."""
BORE_M = 0.10
"""How far beyond the mouth the hand goes: the bore is a little less deep [m]."""
MANOEUVRE = {"Retract": "RETRACTING", "Go to ready": "GOING TO READY"}


@pytest.fixture(scope="module")
def stack(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Stack]:
    """Both sites over the `geo` profile with the tasks as they are shipped."""
    tasks = "hot-stab,hot-stab-removal"
    with farhand_up(tmp_path_factory.mktemp("arm") / "data", "geo", tasks, BESIDE) as stack:
        yield stack


@pytest.fixture(scope="module")
def new_arm_tab(browser: Browser) -> Iterator[NewArmTab]:
    """Opens tabs that are closed in the end."""
    with tabs_of(browser, ArmPage, 1280, 720) as open_one:
        yield open_one


@pytest.fixture(scope="module")
def tab(new_arm_tab: NewArmTab, stack: Stack) -> ArmPage:
    """One tab for most tests here: drawing an arm in software is slow the first time."""
    return new_arm_tab(stack)


def test_dragging_an_arrow_demonstrates_with_the_operators_arm(tab: ArmPage) -> None:
    tab.advises("Record")
    arm = tab.new_place()
    tab.press("Record")
    tab.says("recording", "RECORDING")
    with tab.hold_arrow(arm.tip, axis=2, length_m=0.06):
        tab.says("components", re.compile("^[1-9]"))
    tab.press("End")
    tab.says("miss", re.compile("Not learned: it ends .* Keep anyway"))
    tab.press("Keep anyway")
    tab.says("demos", "1")
    tab.press("Undo")
    tab.says("demos", "0")


def test_the_robots_camera_shows_its_picture_with_its_age_until_it_is_hidden(tab: ArmPage) -> None:
    tab.says("camera-age", re.compile(r"^(OLD: )?[\d.]+ s ago$"))
    picture = tab.page.locator(".fh-camera img")
    expect(picture).to_have_js_property("complete", True, timeout=WAIT_MS)
    assert picture.evaluate("image => image.naturalWidth") >= 160
    tab.press("Camera")
    expect(picture).to_have_count(0, timeout=WAIT_MS)
    tab.press("Camera")
    expect(picture).to_have_count(1, timeout=WAIT_MS)


def test_driving_begins_and_ends_without_a_jump(tab: ArmPage, stack: Stack) -> None:
    arm = tab.new_place()
    with recorded(stack) as robot:
        tab.insist("Arm", "mode", "HOLD")
        assert_accessible(tab)
        tab.insist("Couple", "mode", "DIRECT")
        robot.let_pass(1.0)
        tab.insist("Clutch", "mode", "HOLD")
        robot.let_pass(1.0)
        for axis in (1, 2):
            drive(tab, robot, arm.tip, axis, end=lambda: None)
            robot.until(lambda report: report.mode is ControlMode.HOLD)
            robot.let_pass(2.0)
        drive(tab, robot, arm.tip, 2, end=lambda: tab.page.keyboard.press("Escape"))
        robot.until(lambda report: report.mode is ControlMode.STOPPED)
        robot.let_pass(2.0)
        tab.command("Reset", "DISARMED")
        robot.let_pass(1.0)
    changes = robot.mode_changes(within_s=2.0)
    assert all(change.moved_m <= change.allowed_m for change in changes), changes
    assert max(change.speed_m_s for change in changes if change.after is not ControlMode.DIRECT) > 0.01


def drive(tab: ArmPage, robot: RobotRecord, tip: Array, axis: int, end: Callable[[], object]) -> None:
    """Couple and drag an arrow until the robot has moved; again where the mouse missed it, or the machine was late."""
    for _ in range(3):
        tab.insist("Couple", "mode", "DIRECT")
        robot.let_pass(1.0)
        before = robot.newest.position_m
        with tab.hold_arrow(tip, axis, length_m=0.06):
            robot.until(lambda report: went_m(before, report) > 0.02 or report.mode is not ControlMode.DIRECT)  # noqa: B023
            if robot.newest.mode is ControlMode.DIRECT:
                end()
                return
    raise AssertionError("the robot could not be driven")


def test_the_samples_lead_to_a_seated_plug_by_clicks_alone(tab: ArmPage) -> None:
    tab.execute_until_seated("Load samples")
    tab.says("demos", "5")
    assert 0.0 < tab.number("force") < 60.0
    assert_legible(tab)
    assert_accessible(tab)


def test_a_demonstration_by_the_arrows_leads_to_a_seated_plug(tab: ArmPage) -> None:
    if tab.tp("phase").inner_text() == "SEATED":
        for manoeuvre in ("Retract", "Go to ready"):
            tab.insist(manoeuvre, "phase", MANOEUVRE[manoeuvre])
            tab.tells(f"{MANOEUVRE[manoeuvre].lower()} ended")
            tab.says("mode", "HOLD")
    demos, arm = tab.number("demos"), tab.new_place(ASKEW)
    tab.press("Record")
    tab.says("recording", "RECORDING")
    tab.press("Align")
    expect(tab.local).to_contain_text(ALIGNED, timeout=WAIT_MS)
    tip, frame = np.concatenate([arm.tip[:3], arm.receptacle[3:]]), TaskFrame.at(arm.receptacle)
    for axis, arrow in enumerate(("red", "green")):
        way_m = -float(frame.to_local(tip)[axis])
        lead(tab, tip, axis, way_m, re.compile(rf"{arrow} [+-][0-{AIMED_MM}]\b"))
        tip[:3] += frame.A[:3, axis] * way_m
    lead(tab, tip, 2, BORE_M - float(frame.to_local(tip)[2]), DEEP)
    assert_legible(tab)
    assert_accessible(tab)
    tab.press("End")
    tab.says("demos", f"{demos + 1:.0f}")
    tab.execute_until_seated()


def lead(tab: ArmPage, tip: Array, axis: int, length_m: float, arrived: re.Pattern[str]) -> None:
    """Drag an arrow until the page says that the plug is there; again where the mouse missed the arrow."""
    for _ in range(3):
        with tab.hold_arrow(tip, axis, length_m), suppress(AssertionError):
            expect(tab.local).to_contain_text(arrived, timeout=WAIT_MS / 2.0)
            return
    raise AssertionError(f"the plug could not be led there: {tab.local.inner_text()}, not {arrived.pattern}")


def test_the_other_task_takes_the_plug_out_again(tab: ArmPage) -> None:
    if tab.tp("phase").inner_text() != "SEATED":
        tab.execute_until_seated("Load samples")
    tab.insist("Clutch", "mode", "HOLD")
    tab.choose_task("hot-stab-removal")
    tab.press("Load samples")
    tab.says("demos", "5")
    tab.press("Send library")
    tab.tells("hot-stab: the robot has it already; hot-stab-removal: confirmed after")
    tab.insist("Preview", "plan", re.compile("^preview: [0-9]+ s left"))
    tab.insist("Execute", "mode", "AUTONOMOUS")
    tab.says("phase", "ARRIVED")
    tab.says("depth", re.compile("^1[0-9][0-9] mm away"))
    assert_legible(tab)


def test_a_stop_in_the_bore_holds_gently_while_the_receptacle_sways(
    new_arm_tab: NewArmTab, tmp_path: Path
) -> None:
    with farhand_up(tmp_path / "data", "geo", swaying_task(tmp_path), BESIDE) as stack:
        tab = new_arm_tab(stack)
        with recorded(stack) as robot:
            tab.execute_until_seated("Load samples")
            tab.insist("STOP", "mode", "STOPPED")
            robot.let_pass(30.0)
        forces_n = robot.forces_n(ControlMode.STOPPED)
        assert len(forces_n) > 500
        assert np.quantile(forces_n, 0.95) <= 60.0
        assert np.ptp([report.frame_origin_m for report in robot.reports[-500:]], axis=0).max() > 0.01
