"""Executions are listed as the robot tells of them, in whatever order its events arrive."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import structs

from farhand.common.mode_table import Action, ControlMode, Phase
from farhand.common.task import TaskSet
from farhand.common.wire import keys
from farhand.common.wire.messages import Event, EventKind, ExecutionReport, ReportRequest, Stamp
from farhand.common.wire.reasons import Code, Reason, because
from farhand.local_site.console import intents
from farhand.local_site.console.executions import KEPT, ExecutionHistory
from farhand.local_site.exchange.requests import Requests
from farhand.local_site.teaching.library import Library
from farhand.local_site.view.panels.words.lists import at_the_end, count_words, outcome_words
from tests.local_site.robot_end import TASK, desk
from tests.loopback import OperatorsEnd

JAMMED = because(Code.JAMMED)


def told(seq: int, kind: EventKind, reason: Reason, command: str, boot: str = "boot") -> Event:
    """An event one second after the one before it."""
    return Event(
        seq=seq, stamp=Stamp(boot, seq * 10**9), kind=kind, reason=reason, mode=ControlMode.AUTONOMOUS, command_id=command,
        action="" if kind is EventKind.EXECUTING else Action.EXECUTE, succeeded=kind is not EventKind.FAILED,
    )  # fmt: skip


def began(seq: int, command: str, model: str = f"{TASK.name} 0123abcd") -> Event:
    return told(seq, EventKind.EXECUTING, because(Code.EXECUTING, model=model), command)


def seated(seq: int, command: str, after_s: float = 7.1) -> Event:
    return told(
        seq, EventKind.COMPLETED, because(Code.AT_END, elapsed_s=after_s, phase=Phase.SEATED), command
    )


def failed(seq: int, command: str, why: Reason = JAMMED) -> Event:
    return told(seq, EventKind.FAILED, why, command)


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Library:
    return Library(TaskSet([TASK]), tmp_path_factory.mktemp("library"))


def history_of(library: Library, *events: Event) -> ExecutionHistory:
    """What is remembered of events, each heard when it happened, from a robot that answers nothing."""
    history = ExecutionHistory(Requests(OperatorsEnd(), lambda job: job(), lambda: 0.0), library)
    for event in events:
        history.on_event(event, event.stamp.t_ns * 1e-9)
    return history


def test_each_execution_says_how_it_ended_and_how_many_did_as_they_should(library: Library) -> None:
    known = history_of(
        library, began(1, "a"), failed(9, "a"), began(20, "b"), seated(27, "b"), began(30, "c")
    ).known
    assert [each.command_id for each in known.newest] == ["c", "b", "a"]
    assert [outcome_words(each, n == 0) for n, each in enumerate(known.newest)] == [
        "under way",
        "seated",
        "jammed too often",
    ]
    assert [each.took_s for each in known.newest] == [None, 7.1, pytest.approx(8.0)]
    assert {(each.task, each.model) for each in known.newest} == {(TASK.name, "0123abcd")}
    assert count_words(known) == "1 of 2 ended as they should"


def test_an_execution_without_an_end_is_under_way_only_while_it_is_the_newest(library: Library) -> None:
    known = history_of(library, began(1, "a"), began(2, "b")).known
    assert [outcome_words(each, n == 0) for n, each in enumerate(known.newest)] == [
        "under way",
        "its end was not told",
    ]
    assert count_words(known) == "none has ended yet"


@given(st.permutations([began(1, "a"), failed(9, "a"), began(20, "b"), seated(27, "b"), began(30, "c")]))
def test_the_list_does_not_depend_on_the_order_in_which_an_outage_lets_events_through(
    library: Library, events: list[Event]
) -> None:
    in_order = sorted(events, key=lambda event: event.seq)
    assert history_of(library, *events).known == history_of(library, *in_order).known


def test_other_events_are_no_executions(library: Library) -> None:
    preview = structs.replace(told(1, EventKind.COMPLETED, because(Code.DONE), "p"), action=Action.PREVIEW)
    why = because(Code.STOPPED_BY, site="ann")
    stop = structs.replace(told(2, EventKind.STOPPED, why, ""), action="", command_id="")
    assert history_of(library, preview, stop).known.newest == ()


def test_a_restart_of_the_robot_ends_what_it_executed(library: Library) -> None:
    history = history_of(library, began(1, "a"), seated(2, "a"), began(3, "b"))
    history.on_restart("another boot")
    assert [each.ended is not None and each.ended.code for each in history.known.newest] == [
        Code.INTERRUPTED,
        Code.AT_END,
    ]
    assert "interrupted by a restart" in outcome_words(history.known.newest[0], newest=True)


def test_only_the_newest_are_remembered(library: Library) -> None:
    n = KEPT + 7
    known = history_of(library, *(began(k, f"{k}") for k in range(1, n + 1))).known
    assert [each.command_id for each in known.newest] == [f"{k}" for k in range(n, n - KEPT, -1)]


def test_the_console_names_the_revision_and_asks_the_robot_what_it_measured(tmp_path: Path) -> None:
    with desk(tmp_path) as it:
        it.connected()
        it.console.submit(intents.LoadSamples())
        learned = it.until(lambda p: p.learned is not None).learned
        assert learned is not None
        it.robot.measured = ExecutionReport(
            began=Stamp("boot", 10**9),
            depth_m=0.0851,
            lateral_m=0.0004,
            peak_force_n=17.6,
            stamp=it.robot.now(),
        )
        for event in (began(1, "a", f"{TASK.name} {learned.sha256[:8]}"), seated(2, "a")):
            it.robot.say(keys.EVENT, event)
        (only,) = it.until(lambda p: any(each.report for each in p.executions.newest)).executions.newest
        assert only.revision == it.picture.revision == 1
        assert only.report is not None and only.report == it.robot.measured
        assert at_the_end(only.report) == "85 mm deep, 0.4 mm beside"
        # The report of a later execution is not taken for an earlier one's.
        it.robot.measured = ExecutionReport(
            began=Stamp("boot", 9 * 10**9), peak_force_n=3.0, stamp=it.robot.now()
        )
        for event in (began(3, "b"), failed(4, "b")):
            it.robot.say(keys.EVENT, event)
        it.until(lambda p: len(p.executions.newest) == 2 and p.executions.n_ended == 2)
        it.robot.wait_for(ReportRequest, 2)
        it.console.ask_report()  # what came before was processed when this is answered
        assert it.picture.executions.newest[0].report is None
        assert it.picture.executions.newest[1] == only
