"""Demonstrations made on the robot, through a link: recorded there, fetched, learned, sent back, executed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from farhand.common.impairment.impairment import DirectionSettings, LinkSettings
from farhand.common.link.endpoint import EndpointSettings
from farhand.common.mode_table import Action, ControlMode, Phase
from farhand.deploy.places import find_task, find_tasks
from farhand.evaluation.harness.virtual_job import VirtualPlace
from farhand.evaluation.harness.virtual_sites import VirtualSites
from farhand.local_site.console import intents
from farhand.local_site.script.scripted_actions import ScriptedActions
from farhand.local_site.script.scripted_driving import demonstrate_by_driving
from farhand.local_site.teaching.library import Library
from farhand.remote_site.config import RemoteConfig

_WAY = DirectionSettings(delay_ms=300.0)
LINK = LinkSettings(uplink=_WAY, downlink=_WAY)


class Job:
    """A robot that is armed, and a scripted operator."""

    def __init__(self, task: str, folder: Path, config: RemoteConfig | None = None):
        self.task, self.library = find_task(task), Library(find_tasks(task), folder)
        self.sites = VirtualSites(self.library, LINK, config or RemoteConfig(seed=1))
        place = VirtualPlace(self.sites, LINK)
        self.actions = ScriptedActions(place, place)
        self.actions.command(Action.ARM, ControlMode.HOLD)

    def execute(self) -> None:
        self.actions.submit(intents.SendModel())
        self.actions.until("its confirmation", lambda p: bool(p.confirmed_sha256))
        assert self.actions.preview()
        self.actions.command(Action.EXECUTE, ControlMode.AUTONOMOUS)


@pytest.mark.parametrize("outage", [False, True], ids=["steady", "cut while it is fetched"])
def test_a_stroke_driven_on_the_robots_board_is_executed_as_any_other(tmp_path: Path, outage: bool):
    job = Job("planar", tmp_path)
    if outage:
        job.sites.time.call_at(9.5, job.sites.link.cut)  # it is on its way
        job.sites.time.call_at(29.5, job.sites.link.mend)
    demonstrate_by_driving(job.task, job.actions, seed=1)
    assert (job.sites.time.now_s() > 29.0) is outage
    (shown,) = job.library.chosen.demonstrations
    assert shown.frames_move and "recorded by the robot" in shown.source
    np.testing.assert_allclose(np.diff(shown.time_s), 0.02, atol=1e-4)
    assert np.ptp(shown.frame_origin_m, axis=0).max() > 0.05  # its target swings
    np.testing.assert_allclose(shown.in_frame()[-1], 0.0, atol=0.06)  # the operator saw it 0.3 s late
    assert job.actions.manoeuvre(Action.GO_TO_READY)
    job.execute()
    job.actions.until("its arrival", lambda p: p.phase is Phase.ARRIVED)
    job.actions.submit(intents.Undo())
    assert job.actions.until("the undoing", lambda p: p.n_demonstrations == 0).learned is None


def test_two_strokes_in_a_row_over_a_narrow_link_are_both_learned(tmp_path: Path):
    narrow = RemoteConfig(
        seed=1, link=EndpointSettings(listen="tcp/127.0.0.1:0", rate_bps=9600.0)
    )  # parts of 480 B
    job = Job("planar", tmp_path, narrow)
    job.actions.command(Action.COUPLE, ControlMode.DIRECT)
    for number in (1, 2):
        job.actions.submit(intents.RecordDemonstration())
        job.actions.until("the recording", lambda p: p.robot_records)
        for k in range(60):
            job.actions.submit(intents.Hand((0.004 * k, 0.001 * k), 0.03 * k))
            job.actions.time.pause(0.03)
        assert number == 1 or job.actions.picture.fetching is not None  # the first one is still on its way
        job.actions.submit(intents.EndDemonstration())
        job.actions.until("its end", lambda p: not p.robot_records)
    job.actions.until("both", lambda p: p.n_demonstrations == 2)
    assert not job.actions.picture.can_recover


def test_a_plug_driven_into_the_receptacle_is_seated_again_by_the_robot_itself(tmp_path: Path):
    job = Job("hot-stab", tmp_path)
    assert job.actions.manoeuvre(Action.GO_TO_READY)
    demonstrate_by_driving(job.task, job.actions, seed=1)
    (shown,) = job.library.chosen.demonstrations
    assert shown.space.oriented and shown.frames_move
    np.testing.assert_allclose(np.diff(shown.time_s), 0.01, atol=1e-4)
    assert 0.075 < shown.in_frame()[-1][2] < 0.095  # the robot believes that it is seated
    assert job.actions.manoeuvre(Action.RETRACT) and job.actions.manoeuvre(Action.GO_TO_READY)
    job.execute()
    job.actions.until("its end", lambda p: p.phase.at_end or p.mode is not ControlMode.AUTONOMOUS)
    job.actions.until("the seat", lambda p: p.phase is Phase.SEATED)
