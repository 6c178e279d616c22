"""Fetcher of contents from the robot by their hash: in parts, each requested when the previous one came."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

from farhand.common.link.budget import part_bytes
from farhand.common.wire import keys
from farhand.common.wire.messages import BlobReply, BlobRequest
from farhand.local_site.exchange.requests import Requests

Done = Callable[[bytes | None], None]

_GIVE_UP_S = 600.0
_ATTEMPTS = 3


@dataclass
class _Fetch:
    """Content being fetched.

    Args:
        sha256: SHA-256 of the content.
        done: Gets the content, or None.
        size: Size of the whole content [B]; 0 before the first part.
        arrived: Bytes that arrived, from the beginning on.
        attempts: Number of attempts.
    """

    sha256: str
    done: Done
    size: int = 0
    arrived: bytearray = field(default_factory=bytearray)
    attempts: int = 1


class BlobFetcher:
    """Fetcher of one part at a time, of the content requested last. Used by the console's thread alone.

    A part lost in an outage is requested again; parts that arrived are kept.

    Args:
        inquiries: Asks the robot.
        rate_bps: Capacity of the link [bit/s], 0 for more than enough; it sets the size of the parts.
    """

    def __init__(self, inquiries: Requests, rate_bps: float = 0.0):
        self._inquiries, self._part_bytes = inquiries, part_bytes(rate_bps)
        self._open: list[_Fetch] = []
        self._asking = False

    def fetch(self, sha256: str, done: Done) -> None:
        """Fetch a content in the background; returns at once.

        Args:
            sha256: SHA-256 of the content.
            done: Called once with the content, whose hash was verified, or with None when it cannot be had.
        """
        self._open.append(_Fetch(sha256, done))
        self._ask()

    def share(self, sha256: str) -> float | None:
        """Return the share of a content that has arrived, from 0 to 1; None when it is not being fetched."""
        for fetch in self._open:
            if fetch.sha256 == sha256:
                return len(fetch.arrived) / fetch.size if fetch.size else 0.0
        return None

    def _ask(self) -> None:
        if self._asking or not self._open:
            return
        fetch, self._asking = self._open[-1], True
        request = BlobRequest(sha256=fetch.sha256, offset=len(fetch.arrived), n_bytes=self._part_bytes)
        self._inquiries.ask(keys.BLOB, request, BlobReply, _GIVE_UP_S, partial(self._on_reply, fetch))

    def _on_reply(self, fetch: _Fetch, reply: BlobReply | None, _took_s: float) -> None:
        self._asking = False
        if reply is None or not reply.content:
            self._end(fetch, None)
        elif reply.sha256 == fetch.sha256 and reply.offset == len(fetch.arrived):
            fetch.size = reply.size
            fetch.arrived += reply.content
            if len(fetch.arrived) >= fetch.size:
                self._verify(fetch)
        self._ask()

    def _verify(self, fetch: _Fetch) -> None:
        content = bytes(fetch.arrived)
        if hashlib.sha256(content).hexdigest() == fetch.sha256:
            self._end(fetch, content)
        elif fetch.attempts == _ATTEMPTS:
            self._end(fetch, None)
        else:
            fetch.attempts, fetch.size = fetch.attempts + 1, 0
            fetch.arrived.clear()

    def _end(self, fetch: _Fetch, content: bytes | None) -> None:
        self._open.remove(fetch)
        fetch.done(content)
