"""Bad neighbours of a robot's port: a raw peer of the transport that tries everything, and one that reads nothing."""

from __future__ import annotations

import json
import threading
from typing import Any

import zenoh

from farhand.common.link.endpoint import EndpointSettings, zenoh_configuration
from farhand.evaluation.harness.bad_neighbours import DeafNetwork

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
        self._network = DeafNetwork(endpoint)
        self.raw = RawPeer(self._network.endpoint)

    def stop_reading(self) -> None:
        self._network.stop_reading()

    def close(self) -> None:
        self._network.close()
        self.raw.close()
