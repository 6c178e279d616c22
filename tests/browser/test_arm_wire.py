"""The arm's page without a browser that draws: what a tab sends, and what the robot reports of it, beside the link.

So that it holds on a busy machine too, where a browser that draws in software starves all else.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from farhand.common.mode_table import ControlMode, Phase
from farhand.common.wire.messages import Telemetry
from farhand.local_site.workcell.held_arm import HeldArm
from tests.browser.raw_client import RawClient, raw_connection
from tests.browser.robot_record import BESIDE, RobotRecord, recorded
from tests.browser.stack import Stack, farhand_up, swaying_task
from tests.cells import JACO

pytestmark = [pytest.mark.soak, pytest.mark.timeout(400)]

GIZMO = "/local/hand"
STEP_S = 0.05
"""A browser sends no more of a drag."""
N_STEPS, WAY_M = 40, 0.08
MOST_N = 60.0
TOWARDS_DIRECT = {ControlMode.STOPPED: "Reset", ControlMode.DISARMED: "Arm", ControlMode.HOLD: "Couple"}
TOWARDS_SEATED = {ControlMode.STOPPED: "Reset", ControlMode.DISARMED: "Arm", ControlMode.PAUSED: "Resume"}
"""A robot that a busy machine has stopped for a missed deadline is reset like any other; what comes too late is refused,
and asked for again."""


class Operator:
    """A tab that may act, and the robot's own reports.

    Args:
        tab: The client.
        robot: Its reports.
    """

    def __init__(self, tab: RawClient, robot: RobotRecord):
        self.tab, self.robot = tab, robot

    def insist(self, label: str, holds: Callable[[Telemetry], bool]) -> None:
        """Press until the robot reports it: on a busy machine a command may come too late, and is refused."""
        for _ in range(5):
            self.tab.press(label)
            if self.robot.shows(holds, timeout_s=8.0):
                return
        raise AssertionError(f"{label} led to {self.robot.newest}")

    def couple(self) -> None:
        """Have the hand drive the robot, from whatever mode; then rest for two seconds."""
        for _ in range(12):
            mode = self.robot.newest.mode
            if mode is ControlMode.DIRECT:
                break
            self.tab.press(TOWARDS_DIRECT[mode])
            self.robot.shows(lambda report: report.mode is not mode, timeout_s=5.0)  # noqa: B023
            self.robot.let_pass(2.0)
        assert self.robot.newest.mode is ControlMode.DIRECT

    def uncoupled(self) -> None:
        """Wait until the robot follows no more, and two seconds longer."""
        self.robot.until(lambda report: report.mode is not ControlMode.DIRECT)
        self.robot.let_pass(2.0)

    def execute_until_seated(self) -> None:
        """The whole job with the samples."""
        self.tab.press("Load samples")
        self.insist("Send model", lambda report: bool(report.model))
        for _ in range(12):
            mode = self.robot.newest.mode
            if mode is ControlMode.AUTONOMOUS:
                self.robot.until(lambda report: report.phase is Phase.SEATED or report.mode is not mode)  # noqa: B023
            elif mode is not ControlMode.HOLD:
                self.tab.press(TOWARDS_SEATED[mode])
            elif self.previewed():
                self.tab.press("Execute")
            if self.robot.newest.phase is Phase.SEATED:
                return
            self.robot.shows(lambda report: report.mode is not mode, timeout_s=8.0)  # noqa: B023
        raise AssertionError(f"the plug was never seated: {self.robot.newest}")

    def previewed(self) -> bool:
        """Ask for a preview; whether the page has it."""
        self.tab.press("Preview")
        return self.tab.shows("preview: 5[0-9] s left", timeout_s=20.0)

    def drag(self) -> Iterator[None]:
        """A drag of the gizmo, away from the receptacle, in steps of a twentieth of a second; let go on the way."""
        poses = np.repeat(HeldArm("insert", JACO, seed=0).view().tip[None], N_STEPS, axis=0)
        poses[:, 0] -= np.linspace(0.0, WAY_M, N_STEPS)
        for _ in self.tab.drag(GIZMO, poses):
            self.robot.let_pass(STEP_S)
            yield


@pytest.fixture
def stack(tmp_path: Path) -> Iterator[Stack]:
    """Both sites over the `geo` profile, the receptacle swaying by 20 mm."""
    with farhand_up(tmp_path / "data", "geo", swaying_task(tmp_path), BESIDE) as stack:
        yield stack


@pytest.fixture
def operator(stack: Stack) -> Iterator[Operator]:
    """The one tab."""
    with raw_connection(stack.address) as connection, recorded(stack) as robot:
        yield Operator(RawClient(connection), robot)


def test_no_change_of_mode_moves_a_robot_at_rest_and_a_moving_one_only_brakes(operator: Operator) -> None:
    robot = operator.robot
    operator.couple()
    operator.tab.press("Clutch")
    operator.uncoupled()
    for way_out in ("let go", "Clutch", "STOP"):
        operator.couple()
        for k, _ in enumerate(operator.drag()):
            if k == N_STEPS - 5 and way_out != "let go":
                operator.tab.press(way_out)
        operator.uncoupled()
    changes = robot.mode_changes(within_s=2.0)
    assert all(change.moved_m <= change.allowed_m for change in changes), changes
    out = [change for change in changes if change.before is ControlMode.DIRECT]
    assert len(out) >= 4
    assert max(change.speed_m_s for change in out) > 0.01


def test_a_stop_in_the_bore_holds_gently_while_the_receptacle_sways(operator: Operator) -> None:
    robot = operator.robot
    operator.execute_until_seated()
    operator.insist("STOP", lambda report: report.mode is ControlMode.STOPPED)
    robot.let_pass(30.0)
    forces_n = robot.forces_n(ControlMode.STOPPED)
    assert len(forces_n) > 500
    assert np.quantile(forces_n, 0.95) <= MOST_N
    swayed_m = np.ptp([report.frame_origin_m for report in robot.reports[-500:]], axis=0).max()
    assert swayed_m > 0.01
