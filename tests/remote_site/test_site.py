"""The robot's own process code in real time over a real link: its computer is suspended under it."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from farhand.common.address import free_port
from farhand.common.link.endpoint import EndpointSettings
from farhand.common.mode_table import Action, ControlMode
from farhand.common.task import TaskSet
from farhand.common.wire import keys
from farhand.common.wire.messages import CommandReply, EventsReply, EventsRequest, MoveTarget, Telemetry
from farhand.remote_site.config import RemoteConfig
from farhand.remote_site.site import RemoteSite
from tests.messages import said
from tests.remote_site.planar import TASK
from tests.robustness.raw_operator import RawOperator

SUSPENDED_S = 60.0


class Computer:
    """This one, which the test pretends to suspend: one clock of it goes on, and the other stands still."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch):
        self._suspended_ns = 0
        read = time.clock_gettime_ns

        def clock_gettime_ns(clock: int) -> int:
            return read(clock) + (self._suspended_ns if clock == time.CLOCK_BOOTTIME else 0)

        monkeypatch.setattr(time, "clock_gettime_ns", clock_gettime_ns)

    def suspend(self) -> None:
        self._suspended_ns += round(SUSPENDED_S * 1e9)


@contextmanager
def running(data_dir: Path) -> Iterator[RawOperator]:
    """A robot, and who holds its lease."""
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    config = RemoteConfig(link=EndpointSettings(listen=endpoint), lease_s=600.0, max_age_s=30.0)
    site, ready = RemoteSite(config, TaskSet([TASK]), data_dir), threading.Event()
    thread = threading.Thread(target=site.run, args=(ready.set,))
    thread.start()
    try:
        assert ready.wait(150.0)
        operator = RawOperator(endpoint)
        try:
            yield operator
        finally:
            operator.close()
    finally:
        site.stop()
        thread.join(60.0)
        assert not thread.is_alive()


def test_a_suspended_robot_begins_again_disarmed_and_refuses_what_was_asked_before(
    tmp_path: Path, monkeypatch
):
    computer = Computer(monkeypatch)
    with running(tmp_path) as operator:
        before = operator.bring_to_hold()
        stale = operator.new_command(Action.COUPLE)
        computer.suspend()
        after = operator.report(lambda report: report.stamp.boot != before.stamp.boot)
        assert after.mode is ControlMode.DISARMED and not after.lease
        assert after.position_m == pytest.approx(before.position_m)
        reply = operator.ask(keys.COMMAND, stale, CommandReply)
        assert not reply.accepted and operator.report().mode is ControlMode.DISARMED
        # Its events are kept for who was not connected when they were announced.
        answer = operator.ask(keys.EVENTS, EventsRequest(), EventsReply)
        (event,) = [event for event in answer.events if event.kind == "restarted"]
        assert "suspended for 60.0 s" in said(event) and not event.succeeded


@pytest.mark.parametrize("suspended", [False, True])
def test_the_age_of_what_was_sent_before_counts_the_suspend(tmp_path: Path, monkeypatch, suspended: bool):
    computer = Computer(monkeypatch)
    monkeypatch.setattr("farhand.remote_site.site.SuspendWatch", NeverNotices)  # the second line of defence
    with running(tmp_path) as operator:
        before: Telemetry = operator.bring_to_hold()
        stale = operator.new_command(Action.COUPLE)
        dragged = MoveTarget(echo=before.stamp, lease_id=operator.lease_id, position_m=(0.2, 0.2))
        if suspended:
            computer.suspend()
        n_refused = operator.report().stale_refused
        operator.send(keys.TARGET, dragged)
        reply = operator.ask(keys.COMMAND, stale, CommandReply)
        assert reply.accepted != suspended
        now = operator.report(lambda report: report.stale_refused >= n_refused + (2 if suspended else 0))
        assert now.stamp.boot == before.stamp.boot
        if suspended:
            assert now.mode is ControlMode.HOLD and "too late" in said(reply)


class NeverNotices:
    """A watch that notices no suspend."""

    def suspended_s(self) -> float:
        return 0.0
