"""Send library: real sites, in virtual time; what is moved is counted on the link."""

from __future__ import annotations

from pathlib import Path

import pytest
from msgspec import structs

from farhand.common.impairment.impairment import DirectionSettings, LinkSettings
from farhand.common.mode_table import Action
from farhand.common.task import TaskSet
from farhand.common.wire import keys
from farhand.common.wire.codec import decode
from farhand.common.wire.messages import ModelTransfer
from farhand.evaluation.harness.virtual_sites import VirtualSites
from farhand.local_site.console import intents
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.teaching.library import Library
from farhand.local_site.teaching.samples import sample_strokes
from farhand.remote_site.config import RemoteConfig
from tests.meeting import Meeting, Site
from tests.remote_site.planar import TASK

OTHER = structs.replace(TASK, name="other")


@pytest.fixture
def meeting() -> Meeting:
    return Meeting([TASK, OTHER])


@pytest.fixture
def ann(meeting: Meeting, tmp_path: Path) -> Site:
    """Both tasks were taught, each differently; the first one is chosen."""
    ann = meeting.join("ann", tmp_path / "ann")
    samples = sample_strokes(TASK)
    for name, shown in (("planar", samples), ("other", samples[1:])):
        ann.library.by_task[name].learn(shown)
    return ann


def transfers(site: Site) -> list[ModelTransfer]:
    """The transfers of models that were sent since this was asked last, whether they arrived or not."""
    sent = [decode(data, ModelTransfer) for channel, data in site.link.asked if channel is keys.MODEL]
    site.link.asked.clear()
    return sent


def moved(site: Site) -> dict[str, int]:
    """How much of each task's model was sent since this was asked last [B]."""
    sent = transfers(site)
    tasks = {transfer.task for transfer in sent}
    return {name: sum(len(part.content) for part in sent if part.task == name) for name in tasks}


def lengths(site: Site) -> dict[str, int]:
    return {name: len(learned.content) for name, learned in site.library.learned.items()}


def confirmed(picture: ConsoleState) -> bool:
    return not any(task.differs for task in picture.tasks)


def test_send_library_moves_only_what_differs(meeting: Meeting, ann: Site):
    picture = ann.ask(intents.SendLibrary())
    assert confirmed(picture) and not picture.sending_library
    assert moved(ann) == lengths(ann)
    assert ann.told("send library: planar: confirmed after")
    # Again: nothing differs.
    ann.ask(intents.SendLibrary())
    assert ann.told("send library: refused: the robot has it already")
    assert moved(ann) == {}
    # One task is refined.
    assert ann.ask(intents.Choose("other"), intents.LoadSamples()).tasks[1].differs
    assert confirmed(ann.ask(intents.SendLibrary()))
    assert ann.told("send library: planar: the robot has it already; other: confirmed after")
    assert moved(ann) == {"planar": 0, "other": lengths(ann)["other"]}


def test_after_a_restart_of_the_operators_site_the_robot_is_asked_and_nothing_is_moved(
    meeting: Meeting, ann: Site, tmp_path: Path
):
    ann.ask(intents.SendLibrary())
    meeting.leave(ann)
    again = meeting.join("ann", tmp_path / "ann")
    assert confirmed(again.picture)  # asked at once: nothing is said to be lacking that is there
    assert confirmed(again.ask(intents.SendLibrary()))
    assert moved(again) == {"planar": 0, "other": 0}


def test_a_restarted_robot_gets_all_of_it_again(meeting: Meeting, ann: Site):
    ann.ask(intents.SendLibrary())
    moved(ann)
    meeting.restart_robot()
    meeting.run(1.0)
    assert not any(task.confirmed_sha256 for task in ann.picture.tasks)
    assert confirmed(ann.ask(intents.SendLibrary()))
    assert moved(ann) == lengths(ann)


def test_what_is_sent_of_another_task_is_not_executed_for_this_one(meeting: Meeting, ann: Site):
    ann.ask(intents.Choose("other"), intents.SendModel(), intents.Choose("planar"), Action.ARM)
    ann.ask(Action.EXECUTE)
    assert ann.told("execute: refused: the robot has confirmed no model")
    ann.ask(intents.SendLibrary(), Action.EXECUTE)
    assert ann.told(f"executing planar {ann.library.learned['planar'].sha256[:8]}")
    ann.ask(Action.ABORT, intents.Choose("other"), Action.EXECUTE)
    assert ann.told(f"executing other {ann.library.learned['other'].sha256[:8]}")


def test_a_task_that_the_robot_does_not_do_is_named_and_nothing_of_it_is_sent(
    meeting: Meeting, tmp_path: Path
):
    meeting.tasks, both = TaskSet([TASK]), meeting.tasks
    meeting.restart_robot()
    meeting.tasks = both
    bob = meeting.join("bob", tmp_path / "bob")
    assert bob.told("task: this robot does not do other, only planar")
    for each in bob.library.by_task.values():
        each.learn(sample_strokes(TASK))
    picture = bob.ask(intents.SendLibrary())
    assert bob.told("other: this robot does not do it") and set(moved(bob)) == {"planar"}
    assert [task.robot_does for task in picture.tasks] == [True, False] and confirmed(picture)
    bob.ask(intents.Choose("other"), intents.SendModel())
    assert bob.told("refused: this robot does 'planar', not 'other'") and not transfers(bob)


def test_nothing_is_sent_where_nothing_was_taught(meeting: Meeting, tmp_path: Path):
    bob = meeting.join("bob", tmp_path / "bob")
    bob.ask(intents.SendLibrary())
    assert bob.told("refused: nothing was learned yet") and not transfers(bob)


def test_over_a_narrow_link_both_models_arrive_though_it_is_cut_in_the_middle(tmp_path: Path):
    library = Library(TaskSet([TASK, OTHER]), tmp_path)
    samples = sample_strokes(TASK)
    library.chosen.learn(samples)
    library.by_task["other"].learn(samples[1:])
    way = DirectionSettings(delay_ms=1000.0, rate_bps=9600.0)
    sites = VirtualSites(library, LinkSettings(uplink=way, downlink=way), RemoteConfig(link=structs.replace(RemoteConfig().link, rate_bps=9600.0)))  # fmt: skip
    sites.run(5.0)
    sites.console.submit(intents.SendLibrary())
    sites.run(8.0)
    assert sites.console.picture.sending_library
    sites.link.cut()
    sites.run(10.0)
    sites.link.mend()
    for _ in range(90):
        sites.run(1.0)
        if confirmed(sites.console.picture):
            break
    assert confirmed(sites.console.picture), sites.console.picture.notices[-3:]
