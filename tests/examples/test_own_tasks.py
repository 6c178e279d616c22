"""The examples of tasks with two frames: what is learned follows both, in the plane and in space, at both sites."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from farhand.common.configuration import load_toml
from farhand.common.impairment.impairment import DirectionSettings, LinkSettings
from farhand.common.model.task_frame import TaskFrame
from farhand.common.model.tphsmm import TPHSMM
from farhand.common.task import PointTask, TaskSet, load_task
from farhand.evaluation.harness.virtual_job import do_job
from farhand.evaluation.harness.virtual_sites import VirtualSites
from farhand.local_site.learning.online_learner import LearnerSettings, OnlineLearner
from farhand.local_site.teaching.library import Library
from farhand.local_site.teaching.samples import sample_strokes
from farhand.remote_site.config import RemoteConfig
from farhand.remote_site.reproduction.executor import Executor
from farhand.remote_site.reproduction.executor_settings import ExecutorSettings

ROOT = Path(__file__).parents[2]
FILE = ROOT / "examples" / "tasks" / "through-gate.toml"
PLANE, SPACE = (load_toml(file, PointTask) for file in (FILE, FILE.with_name("over-wall.toml")))
DT_S = 0.02


def learned(task: PointTask, n_frames: int) -> TPHSMM:
    assert task.learning.max_distance_m is not None
    settings = LearnerSettings(task.learning.max_distance_m, min_std_m=task.learning.min_std_m)
    learner = OnlineLearner(settings, task.n_dims, task.frame_names[-n_frames:])
    for stroke in sample_strokes(task):
        learner.start()
        learner.observe_many(stroke.position_m, stroke.frames_at(0)[-n_frames:], stroke.time_s)
        learner.end()
    return learner.model()


def executed(task: PointTask, model: TPHSMM, frames: Sequence[TaskFrame]) -> NDArray[np.float64]:
    """Positions of a motion from the task's start. Shape (n, D)."""
    limits = task.limits
    executor = Executor(model, ExecutorSettings(DT_S, limits.speed_m_s, limits.acceleration_m_s2))
    position, velocity = np.array(task.start_m), np.zeros(task.n_dims)
    executor.begin(position, velocity, frames)
    way = [position]
    for _ in range(600):
        control = executor.step(position, velocity, frames)
        if control.arrived:
            break
        position = position + velocity * DT_S + 0.5 * control.acceleration * DT_S**2
        velocity = velocity + control.acceleration * DT_S
        way.append(position)
    return np.array(way)


def test_the_documents_have_the_file_as_it_is():
    assert f"```toml\n{FILE.read_text('utf-8')}```" in (ROOT / "docs" / "extending.md").read_text("utf-8")


@pytest.mark.parametrize("task", [PLANE, SPACE], ids=["plane", "space"])
def test_the_robot_passes_the_gate_and_reaches_the_dock_wherever_both_are(task: PointTask):
    both, dock_alone = learned(task, 2), learned(task, 1)
    missed_m = []
    for place in range(11, 19):
        gate, dock = frames = [TaskFrame.at(mean) for mean in task.means_m(place)]
        way = executed(task, both, frames)
        assert np.linalg.norm(way[-1] - dock.b) < 0.03
        assert np.linalg.norm(way - gate.b, axis=1).min() < 0.10
        missed_m.append(np.linalg.norm(executed(task, dock_alone, [dock]) - gate.b, axis=1).min())
    assert max(missed_m) > 0.12  # what knows the dock alone does not


@pytest.mark.parametrize("task", [PLANE, SPACE], ids=["plane", "space"])
def test_the_whole_job_is_done_at_both_sites(task: PointTask, tmp_path: Path):
    way = DirectionSettings(delay_ms=150.0)
    settings = LinkSettings(uplink=way, downlink=way)
    sites = VirtualSites(Library(TaskSet([task]), tmp_path), settings, RemoteConfig(seed=3))
    result = do_job(sites, settings, None, seed=3)
    assert result["success"] is True and result["n_demonstrations"] == len(task.samples)


def test_an_arm_that_is_taught_relative_to_its_base_too_seats_its_plug(tmp_path: Path):
    text = (ROOT / "deploy" / "tasks" / "hot-stab.toml").read_text("utf-8")
    text = text.replace('frame_names = ["receptacle"]', 'frame_names = ["base", "receptacle"]')
    file = tmp_path / "hot-stab.toml"
    file.write_text(f"{text}\n[landmarks.base]\n")
    task, way = load_task(file), DirectionSettings(delay_ms=300.0)
    settings = LinkSettings(uplink=way, downlink=way)
    sites = VirtualSites(Library(TaskSet([task]), tmp_path), settings, RemoteConfig(seed=1))
    result = do_job(sites, settings, None, seed=1)
    assert result["success"] is True and result["execution"]["depth_m"] > 0.075
