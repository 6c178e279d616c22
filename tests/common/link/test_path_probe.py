"""The probe of a path: answered by a real robot's port, and connecting again once that is reachable."""

from __future__ import annotations

import socket
import threading

from farhand.common.link.path_probe import probe


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
