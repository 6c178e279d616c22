"""Bad neighbours of a robot's port: a raw peer of the transport that tries everything, and one that reads nothing."""

from __future__ import annotations

import contextlib
import json
import socket
import threading
from typing import Any

import zenoh

from farhand.common.address import endpoint_address
from farhand.common.link.endpoint import EndpointSettings, zenoh_configuration

VEHICLE = "rov1"


class RawPeer:
    """A session of the transport without a namespace of its own: it names every key in full.

    Args:
        endpoint: The robot's.
        mode: What it claims to be: for a client, a peer passes on what other peers send.
    """

    def __init__(self, endpoint: str, mode: str = "client"):
        configuration: dict[str, Any] = zenoh_configuration(EndpointSettings(connect=endpoint)) | {
            "mode": mode
        }
        configuration["connect"]["timeout_ms"] = 10_000  # no client opens without its peer
        del configuration["namespace"]
        self.session = zenoh.open(zenoh.Config.from_json5(json.dumps(configuration)))
        self.heard: list[str] = []
        """Keys of all that arrived, in order."""
        self.asked: list[str] = []
        """Keys of all questions that arrived."""
        self._arrived = threading.Condition()
        self._declared: list[Any] = []

    def listen(self, key: str) -> None:
        self._declared.append(
            self.session.declare_subscriber(key, lambda s: self._take(self.heard, s.key_expr))
        )

    def serve(self, key: str) -> None:
        def take(query: zenoh.Query) -> None:
            self._take(self.asked, query.key_expr)
            query.reply(query.key_expr, b"stolen")

        self._declared.append(self.session.declare_queryable(key, take, complete=True))

    def until_it_hears(self, key: str) -> None:
        """Wait until something arrives on this key from now on."""
        with self._arrived:
            n = len(self.heard)
            assert self._arrived.wait_for(lambda: key in self.heard[n:], 60.0), (key, self.heard[-5:])

    def ask(self, key: str, data: bytes) -> list[bytes]:
        """The answers to a question."""
        replies = self.session.get(key, payload=data, timeout=10.0)
        return [reply.ok.payload.to_bytes() for reply in replies if reply.ok is not None]

    def close(self) -> None:
        self.session.close()

    def _take(self, where: list[str], key: object) -> None:
        with self._arrived:
            where.append(str(key))
            self._arrived.notify_all()


class DeafPeer:
    """A peer whose network stops taking what comes from the robot, while it goes on sending.

    Args:
        endpoint: The robot's.
    """

    def __init__(self, endpoint: str):
        self._robot = endpoint_address(endpoint)
        self._reads = threading.Event()
        self._reads.set()
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._sockets = [self._listener]
        threading.Thread(target=self._accept, daemon=True).start()
        self.raw = RawPeer(f"tcp/127.0.0.1:{self._listener.getsockname()[1]}")

    def stop_reading(self) -> None:
        self._reads.clear()

    def close(self) -> None:
        self._reads.set()
        for sock in self._sockets:
            sock.close()
        self.raw.close()

    def _accept(self) -> None:
        near, _ = self._listener.accept()  # one only: it does not come back
        far = socket.socket()
        far.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 65536)
        far.connect(self._robot)
        self._sockets += [near, far]
        threading.Thread(target=self._carry, args=(near, far), daemon=True).start()
        threading.Thread(target=self._carry_back, args=(far, near), daemon=True).start()

    def _carry(self, near: socket.socket, far: socket.socket) -> None:
        with contextlib.suppress(OSError):
            while data := near.recv(65536):
                far.sendall(data)

    def _carry_back(self, far: socket.socket, near: socket.socket) -> None:
        with contextlib.suppress(OSError):
            while self._reads.wait() and (data := far.recv(65536)):
                near.sendall(data)
