"""The probe of a path: answered by a real robot's port, and connecting again once that is reachable."""

from __future__ import annotations

import socket
import threading

import pytest

from farhand.common.link.path_probe import PathProbe, probe


def test_a_robots_port_answers_the_probe(robot):
    _, port = robot
    assert probe(("127.0.0.1", port), 0.4, threading.Event(), patience_s=30.0) is not None


def test_a_port_where_nothing_or_something_else_answers_does_not():
    with socket.socket(type=socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        address = other.getsockname()
        done = threading.Event()

        def answer() -> None:
            while not done.is_set():
                data, sender = other.recvfrom(2048)
                other.sendto(data[:20], sender)  # an echo is no answer

        thread = threading.Thread(target=answer, daemon=True)
        thread.start()
        assert probe(address, 0.1, threading.Event(), patience_s=0.5) is None
        done.set()
        with socket.socket(type=socket.SOCK_DGRAM) as last:
            last.sendto(b"end", address)
        thread.join()
    assert probe(address, 0.1, threading.Event(), patience_s=0.5) is None


@pytest.mark.parametrize(("answers", "connects_again"), [(False, True), (True, False)])
def test_a_connection_that_carries_no_answer_on_an_open_path_is_made_anew(
    robot, answers: bool, connects_again: bool
):
    _, port = robot
    asked, again, silent_s = threading.Event(), threading.Event(), 60.0

    def answer(_timeout_s: float) -> bool:
        asked.set()
        return answers

    watch = PathProbe(f"quic/127.0.0.1:{port}", lambda: silent_s, lambda: True, answer, again.set)
    try:
        assert asked.wait(30.0)
        assert again.wait(30.0 if connects_again else 3.0) is connects_again
    finally:
        watch.close()


def test_a_connection_is_made_as_soon_as_the_path_is_there(robot):
    _, port = robot
    again = threading.Event()
    watch = PathProbe(f"quic/127.0.0.1:{port}", lambda: 0.0, again.is_set, lambda _: False, again.set)
    try:
        assert again.wait(30.0)
    finally:
        watch.close()


@pytest.mark.parametrize("survives", [True, False])
def test_after_an_outage_a_connection_that_brings_nothing_is_made_anew_and_one_that_survived_is_kept(
    monkeypatch: pytest.MonkeyPatch, survives: bool
):
    silent, over, again = [60.0], threading.Event(), threading.Event()
    paths = iter((None, None))  # the path is cut for two attempts, then open

    def probed(*_: object) -> float | None:
        if (found := next(paths, 0.01)) is not None:
            silent[0] = 0.0 if survives else silent[0]
            over.set()
        return found

    monkeypatch.setattr("farhand.common.link.path_probe.probe", probed)
    watch = PathProbe("quic/127.0.0.1:1", lambda: silent[0], lambda: True, lambda _: False, again.set)
    try:
        assert over.wait(30.0)
        assert again.wait(3.0 if survives else 30.0) is not survives
    finally:
        watch.close()
