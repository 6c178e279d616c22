"""The three processes of a demo live and end together."""

from __future__ import annotations

import os
import signal

import pytest

from tests.farhand_process import FarhandProcess, await_end, running

READY = "all three are ready"
SITES = {"remote", "link", "local"}


def ready_demo(process: FarhandProcess) -> dict[str, int]:
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
