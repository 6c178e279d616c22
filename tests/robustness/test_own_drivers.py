"""A user's own driver fails in a real robot's process: its machine is halted, it is told, and the process lives on."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from farhand.common.address import free_port
from farhand.common.mode_table import Action, ControlMode
from farhand.common.model.model_file import content_hash
from farhand.common.model.model_file import encode as encode_model
from farhand.common.wire import keys
from farhand.common.wire.messages import EventsReply, EventsRequest, ModelReply, ModelTransfer
from farhand.evaluation.harness.farhand_process import HeardProcess
from tests.farhand_process import refusal, running
from tests.messages import said
from tests.remote_site.planar import short_strokes
from tests.remote_site.robots.own_drivers import put_drivers
from tests.robustness.raw_operator import SESSION, RawOperator


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    return tmp_path


def configuration(folder: Path, fails: str) -> Path:
    file = folder / "remote.toml"
    file.write_text(f'[plant]\nuse = "own"\noptions = {{ fails = "{fails}", log = "{folder / "log"}" }}\n')
    return file


@pytest.mark.parametrize(
    ("fails", "words"), [("read", "OSError: CAN bus is off"), ("fault", "reports a fault: emergency stop")]
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


WHILE_EXECUTING = {
    "accelerate": "OSError: drive 2 does not answer",
    "nan": "a measured number is not finite",
    "stands": "stands still for 2 s although it is told to move",
    "late": "the control loop was ",
}


@pytest.fixture(scope="module")
def executing(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Path, HeardProcess, RawOperator]]:
    """The folder of an own plant, its robot's process for all faults, and an operator whose control never ends."""
    folder, endpoint = tmp_path_factory.mktemp("own"), f"tcp/127.0.0.1:{free_port()}"
    put_drivers(folder, "own")
    options = f'options = {{ trouble = "{folder / "trouble"}", log = "{folder / "log"}" }}'
    file = folder / "remote.toml"
    file.write_text(f'lease_s = 600.0\nmax_age_s = 600.0\n[plant]\nuse = "own"\n{options}\n')
    words = ("remote", "--config", file, f"--listen={endpoint}")
    with running(*words, environment={"PYTHONPATH": str(folder)}) as process:
        process.until("the robot is ready")
        operator = RawOperator(endpoint)
        content = encode_model(short_strokes())
        sent = ModelTransfer(session=SESSION, task="planar", sha256=content_hash(content), content=content)
        assert operator.ask(keys.MODEL, sent, ModelReply).accepted
        yield folder, process, operator
        operator.close()


@pytest.mark.parametrize("fault", WHILE_EXECUTING)
def test_what_fails_while_it_executes_halts_it_is_told_and_leaves_it_fit_for_the_next(
    fault: str, executing: tuple[Path, HeardProcess, RawOperator]
):
    folder, process, operator = executing
    operator.bring_to_hold()
    reply = operator.command(Action.EXECUTE, model_sha256=content_hash(encode_model(short_strokes())))
    assert reply.accepted, reply.reason
    operator.report(lambda told: told.mode is ControlMode.AUTONOMOUS)
    (folder / "log").write_text("")
    (folder / "new").write_text(fault)
    (folder / "new").rename(folder / "trouble")
    operator.report(lambda told: told.mode is ControlMode.STOPPED)
    told = [
        event
        for event in operator.ask(keys.EVENTS, EventsRequest(), EventsReply).events
        if event.kind == "stopped"
    ]
    assert WHILE_EXECUTING[fault] in said(told[-1]) and not told[-1].succeeded
    assert "halt" in (folder / "log").read_text().split() and process.running
    (folder / "trouble").unlink(missing_ok=True)


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
