from __future__ import annotations

import pytest

from farhand.common.mode_table import ControlMode, Phase
from farhand.common.wire.messages import PlannedPath, Stamp, Telemetry
from farhand.local_site.exchange.report_age import LinkMonitor
from farhand.local_site.exchange.reports import Reports


class Follower:
    """Notes when it is to ask for what was missed."""

    def __init__(self) -> None:
        self.asked: list[str] = []

    def catch_up(self, boot: str) -> None:
        self.asked.append(boot)


class Desk:
    def __init__(self) -> None:
        self.events, self.restarts = Follower(), 0
        self.reports = Reports(LinkMonitor(), self.events, self._restarted)  # pyright: ignore[reportArgumentType]

    def _restarted(self) -> None:
        self.restarts += 1

    def report(
        self,
        seq: int,
        now_s: float,
        boot: str = "one",
        mode: ControlMode = ControlMode.HOLD,
        phase: Phase = Phase.NONE,
    ) -> bool:
        told = Telemetry(
            seq=seq, stamp=Stamp(boot, seq), mode=mode, phase=phase, position_m=(0.0, 0.0),
            frame_origin_m=(0.0, 0.0),
        )  # fmt: skip
        return self.reports.on_telemetry(told, now_s)


def path(path_id: int, plan_id: int) -> PlannedPath:
    return PlannedPath(
        path_id=path_id, plan_id=plan_id, stamp=Stamp("one", 1), model_sha256="", n_coordinates=2, step_s=0.1,
        points=b"", reaches_end=True,
    )  # fmt: skip


def test_only_what_is_newer_counts():
    desk = Desk()
    assert desk.report(5, 0.0) and not desk.report(5, 0.1) and not desk.report(4, 0.2)
    assert desk.report(6, 0.3)
    assert desk.reports.robot is not None and desk.reports.robot.seq == 6


def test_events_are_asked_for_at_first_and_after_every_outage():
    desk = Desk()
    desk.report(1, 0.0)
    for n in range(2, 12):
        desk.report(n, 0.1 * n)
    assert desk.events.asked == ["one"]
    desk.report(12, 20.0)
    desk.report(13, 20.1)
    assert desk.events.asked == ["one", "one"]


def test_of_a_robot_that_was_restarted_nothing_counts_any_more():
    desk = Desk()
    desk.report(50, 0.0)
    desk.reports.on_path(path(1, 7), 0.0)
    assert desk.restarts == 0
    assert desk.report(1, 0.1, boot="two")
    assert (desk.restarts, desk.reports.path, desk.reports.plan_id) == (1, None, 0)
    assert desk.events.asked == ["one", "two"]


def test_the_path_of_an_execution_is_shown_and_leaves_the_preview_its_number():
    desk = Desk()
    desk.reports.on_path(path(1, 7), 1.0)
    desk.reports.on_path(path(2, 0), 2.0)
    assert desk.reports.path is not None and desk.reports.path.path_id == 2
    assert (desk.reports.path_received_s, desk.reports.plan_id, desk.reports.plan_received_s) == (2.0, 7, 1.0)


@pytest.mark.parametrize(
    ("mode", "phase", "counts"),
    [
        (ControlMode.HOLD, Phase.NONE, True),
        (ControlMode.PAUSED, Phase.NONE, True),
        (ControlMode.AUTONOMOUS, Phase.SEATED, True),
        (ControlMode.AUTONOMOUS, Phase.ARRIVED, True),
        (ControlMode.AUTONOMOUS, Phase.APPROACHING, False),
        (ControlMode.AUTONOMOUS, Phase.RETRACTING, False),
        (ControlMode.DIRECT, Phase.NONE, False),
    ],
)
def test_a_preview_counts_until_the_robot_moves(mode: ControlMode, phase: Phase, counts: bool):
    desk = Desk()
    desk.report(1, 0.0)
    desk.reports.on_path(path(1, 7), 0.1)
    desk.report(2, 0.2, mode=mode, phase=phase)
    desk.report(3, 0.3)
    assert (desk.reports.plan_id == 7) is counts
    assert desk.reports.path is not None, "an execution goes on to show it until it commits to its own"


def test_a_report_that_is_older_than_the_preview_does_not_end_it():
    desk = Desk()
    preview = PlannedPath(
        path_id=1, plan_id=7, stamp=Stamp("one", 10), model_sha256="", n_coordinates=2, step_s=0.1, points=b"",
        reaches_end=True,
    )  # fmt: skip
    desk.report(1, 0.0)
    desk.reports.on_path(preview, 0.1)
    desk.report(9, 0.2, mode=ControlMode.DIRECT)
    assert desk.reports.plan_id == 7


def test_a_preview_that_no_longer_counts_is_not_shown() -> None:
    """A.4: not after a minute, and not of a model that the robot has no more."""
    for now_s, sha256, counts in (
        (60.0, "", True),
        (60.1, "", False),
        (1.0, "a" * 64, True),
        (1.0, "b" * 64, False),
    ):
        reports = Desk().reports
        preview = PlannedPath(
            path_id=1, plan_id=3, stamp=Stamp("one", 1), model_sha256="a" * 64, n_coordinates=2, step_s=0.1, points=b"",
            reaches_end=True,
        )  # fmt: skip
        reports.on_path(preview, 0.0)
        reports.expire_plan(now_s, sha256)
        assert (reports.plan_id == 3, reports.path is preview) == (counts, counts)
