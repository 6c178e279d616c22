"""The three processes of a demo live and end together."""

from __future__ import annotations

import json
import os
import re
import signal
import socket
import urllib.request
from pathlib import Path

import pytest

from farhand.evaluation.harness.farhand_process import HeardProcess
from tests.farhand_process import await_end, farhand, refusal, running

READY = "all three are ready"
SITES = {"remote", "link", "local"}


def ready_demo(process: HeardProcess) -> dict[str, int]:
    """The children of a demo, once they are ready."""
    process.until(READY)
    children = process.children()
    assert children.keys() == SITES
    return children


@pytest.mark.parametrize(
    ("site", "own_words"),
    [
        ("remote", "the robot is ready"),
        ("link", "the link is ready"),
        ("local", "the robot reports"),
    ],
)
def test_a_child_that_dies_ends_the_demo_with_its_own_words(site, own_words):
    with running("demo", "--link", "lan") as demo:
        children = ready_demo(demo)
        demo.until(own_words)  # a log is written beside the work: a line may come after the word "ready"
        os.kill(children[site], signal.SIGKILL)
        assert demo.wait() == 1
        assert f"farhand: the {site} process was ended by signal 9; its last line: " in demo.words
        assert "Traceback" not in demo.words
        await_end(*children.values())


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_all_three(number):
    with running("demo", "--link", "lan") as demo:
        children = ready_demo(demo)
        demo.send(number)
        assert demo.wait() == 130
        assert "Traceback" not in demo.words
        await_end(*children.values())


def test_no_child_outlives_a_demo_that_was_killed():
    with running("demo", "--link", "lan") as demo:
        children = ready_demo(demo)
        demo.kill()
        await_end(*children.values())


def test_up_with_port_0_takes_a_free_one_and_says_which():
    with running("up", "--task=planar", "--link=lan", "--port=0") as up:
        up.until("the page: ")
        (address,) = re.findall(r"the page: (http://127\.0\.0\.1:[1-9]\d+)", up.words)
        with urllib.request.urlopen(address) as answer:
            assert answer.status == 200
        up.send(signal.SIGINT)
        assert up.wait() == 0
        assert "Traceback" not in up.words


def test_up_whose_page_has_no_port_says_so_and_leaves_words_that_the_status_tells(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv("FARHAND_RUNTIME_DIR", str(tmp_path / "doors"))
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        said = refusal("up", f"--port={port}", f"--data-dir={tmp_path}")
    assert f"port {port} on 127.0.0.1 is in use" in said and "--port" in said
    told = farhand("status", "--json")
    (trouble,) = json.loads(told.stdout)["troubles"]
    assert (trouble["code"], trouble["role"]) == ("port-taken", "operator") and str(port) in trouble["text"]
