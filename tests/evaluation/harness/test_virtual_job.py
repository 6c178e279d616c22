"""The paper's job at both sites in virtual time: two arms, contact, a model of poses, a link that is cut."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from msgspec import structs

from farhand.common.impairment.impairment import DirectionSettings, LinkSettings
from farhand.common.impairment.link_profile import find_profile, load_profiles
from farhand.common.task import TaskSet
from farhand.common.wire.messages import EventsRequest
from farhand.deploy.link.link_process import PROFILES_FILE
from farhand.deploy.places import find_task
from farhand.evaluation.harness.virtual_job import do_job
from farhand.evaluation.harness.virtual_sites import VirtualSites
from farhand.local_site.script.scripted_actions import PlannedOutage
from farhand.local_site.teaching.library import Library
from farhand.remote_site.config import RemoteConfig


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    task, way = find_task("hot-stab"), DirectionSettings(delay_ms=300.0)
    settings = LinkSettings(uplink=way, downlink=way)
    folder: Path = tmp_path_factory.mktemp("library")
    sites = VirtualSites(Library(TaskSet([task]), folder), settings, RemoteConfig(seed=1))
    return do_job(sites, settings, PlannedOutage("blackhole", 4.0), seed=1)


def test_the_plug_is_seated_though_the_link_was_cut_on_the_way(result: dict[str, Any]):
    assert result["task"] == "hot-stab" and result["success"] is True
    assert result["cut_in"] == "APPROACHING"
    execution = result["execution"]
    assert 0.075 <= execution["depth_m"] <= 0.095 and execution["lateral_m"] < 0.004
    assert execution["end_error_m"] < 0.010
    assert 0.0 < execution["holding_force_n"] <= execution["peak_force_n"] < 400.0


def test_five_demonstrations_on_the_operators_arm_become_a_model_of_a_few_kilobytes(result: dict[str, Any]):
    assert result["n_demonstrations"] == 5 and result["model_acknowledged"] is True
    assert 6 <= result["n_components"] <= 20 and result["model_bytes"] < 9_000


def test_it_was_driven_previewed_and_executed_in_this_order(result: dict[str, Any]):
    texts = [event["text"] for event in result["events"]]
    steps = [
        "demonstration 5 of 5",
        "confirmed",
        "couple:",
        "drove",
        "previewed",
        "execute:",
        "cut",
        "seated",
        "disarm:",
    ]
    at = [next(i for i, text in enumerate(texts) if step in text) for step in steps]
    assert at == sorted(at)


def test_several_tasks_are_taught_and_done_one_after_the_other(tmp_path: Path):
    planar = find_task("planar")
    learning = structs.replace(planar.learning, max_distance_m=0.3)
    tasks = TaskSet([planar, structs.replace(planar, name="other", learning=learning)])
    way = DirectionSettings(delay_ms=50.0)
    settings = LinkSettings(uplink=way, downlink=way)
    sites = VirtualSites(Library(tasks, tmp_path), settings, RemoteConfig(seed=1))
    result = do_job(sites, settings, None, seed=1)
    one, other = result["tasks"]
    assert result["success"] is one["success"] is other["success"] is True
    assert (one["task"], other["task"]) == ("planar", "other")
    assert one["model_sha256"] != other["model_sha256"]
    texts = [event["text"] for event in result["events"]]
    assert [text for text in texts if text.startswith("task ")] == ["task other", "task planar", "task other"]
    assert sum("execute:" in text for text in texts) == 2 and sum("drove" in text for text in texts) == 1


def test_the_same_seed_teaches_the_same_model_and_passes_through_the_same_modes(tmp_path: Path):
    def run(folder: str, seed: int) -> tuple[str, bytes, list[tuple[str, str, str]]]:
        settings = find_profile(load_profiles(PROFILES_FILE), "geo").settings
        library = Library(TaskSet([find_task("planar")]), tmp_path / folder)
        sites = VirtualSites(library, settings, RemoteConfig(seed=seed))
        result = do_job(sites, settings, None, seed)
        supervisor = sites.robot.supervisor
        told = supervisor.events.answer(EventsRequest()).events
        end = supervisor.sensing.effector.point.tobytes()
        return result["model_sha256"], end, [(event.kind, event.mode, event.reason.code) for event in told]

    first = run("first", 3)
    assert run("second", 3) == first
    assert run("third", 4)[:2] != first[:2]
