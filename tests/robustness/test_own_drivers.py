"""A user's own driver fails in a real robot's process: its machine is halted, it is told, and the process lives on."""

from __future__ import annotations

import signal
from pathlib import Path

import pytest

from farhand.common.address import free_port
from farhand.common.mode_table import Action, ControlMode
from farhand.common.wire import keys
from farhand.common.wire.messages import EventsReply, EventsRequest
from tests.farhand_process import refusal, running
from tests.messages import said
from tests.remote_site.robots.own_drivers import put_drivers
from tests.robustness.raw_operator import RawOperator


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    return tmp_path


def configuration(folder: Path, fails: str) -> Path:
    file = folder / "remote.toml"
    file.write_text(f'[plant]\nuse = "own"\noptions = {{ fails = "{fails}", log = "{folder / "log"}" }}\n')
    return file


@pytest.mark.parametrize(
    ("fails", "words"), [("read", "OSError: CAN bus is off"), ("fault", "tells a fault: emergency stop")]
)
def test_a_driver_that_fails_leaves_a_process_that_stands_and_answers(folder: Path, fails: str, words: str):
    put_drivers(folder, "own")
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    with running("remote", "--config", configuration(folder, fails), f"--listen={endpoint}") as process:
        process.until("the robot is ready")
        operator = RawOperator(endpoint)
        try:
            operator.report(lambda report: report.mode is ControlMode.STOPPED)
            answer = operator.ask(keys.EVENTS, EventsRequest(), EventsReply)
            (told,) = [event for event in answer.events if event.kind == "stopped"]
            assert words in said(told) and not told.succeeded
            assert operator.command(Action.RESET).accepted  # it is stopped and told again
            operator.report(lambda report: report.mode is ControlMode.STOPPED)
        finally:
            operator.close()
        process.send(signal.SIGTERM)
        assert process.wait() == 0, process.words
    log = (folder / "log").read_text().split()
    assert log[0] == "start" and log[-2:] == ["halt", "close"] and log.count("halt") > 2


@pytest.mark.parametrize(
    ("before", "fails", "words"),
    [
        ("import no_such_module", "", "cannot be imported: ModuleNotFoundError: No module named 'no_such_module'"),
        ("", "start", "cannot be started: OSError: no such bus"),
        ("", "first reading", "does not measure: "),
    ],
)  # fmt: skip
def test_one_that_cannot_begin_ends_its_process_in_one_line(
    folder: Path, before: str, fails: str, words: str
):
    put_drivers(folder, "own", before)
    line = refusal(
        "remote", "--config", configuration(folder, fails), f"--listen=tcp/127.0.0.1:{free_port()}"
    )
    assert f"plant 'own' (own:Plant) {words}" in line and "--plant" in line


def test_a_demo_names_the_drivers_there_are_before_it_starts_anything(folder: Path):
    put_drivers(folder, "own")
    line = refusal("demo", "--task", "planar", "--plant", "owm")
    assert "own, own-nothing" in line and "'owm'" in line
    assert "is the task of an arm" in refusal("demo", "--task", "hot-stab", "--plant", "own")
