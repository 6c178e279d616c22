"""Contents fetched from the robot by their hash, in parts; its drawing, which is kept on disk, is one of them."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from farhand.common.errors import InvalidMessage
from farhand.common.link.budget import part_bytes
from farhand.common.log import loop_logger
from farhand.common.whole_file import read_whole, write_whole
from farhand.common.wire import keys
from farhand.common.wire.messages import BlobReply, BlobRequest
from farhand.common.wire.packed import unpack
from farhand.common.wire.scene_description import SceneDescription
from farhand.local_site.exchange.requests import Requests

_log = loop_logger(__name__)

Done = Callable[[bytes | None], None]

_GIVE_UP_S = 600.0
_ATTEMPTS = 3


@dataclass
class _Fetch:
    """Content being fetched.

    Args:
        sha256: SHA-256 of the content.
        done: Called with the content, or with None.
        size: Size of all that travels [B]; 0 before the first part.
        arrived: Arrived bytes, from the beginning on.
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
        inquiries: Requests to the robot.
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
            done: Called once with the content, whose hash is verified, or with None if it could not be fetched.
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
        content = unpack(bytes(fetch.arrived), fetch.sha256)
        if content is not None:
            self._end(fetch, content)
        elif fetch.attempts == _ATTEMPTS:
            self._end(fetch, None)
        else:
            fetch.attempts, fetch.size = fetch.attempts + 1, 0
            fetch.arrived.clear()

    def _end(self, fetch: _Fetch, content: bytes | None) -> None:
        self._open.remove(fetch)
        fetch.done(content)


_DRAWING_ATTEMPTS = 5
_SKETCH_BELOW_BPS = 100_000.0
"""Rate of a link below which a sketch of the robot is fetched before its drawing [bit/s]."""


class KnownScenes:
    """Descriptions by their hash, including those of earlier robots.

    Args:
        folder: Folder of the descriptions; made when one is kept.
        own: Built-in descriptions.
    """

    def __init__(self, folder: Path, own: Sequence[SceneDescription] = ()):
        self._folder, self._known = folder, {scene.sha256: scene for scene in own}

    def get(self, sha256: str) -> SceneDescription | None:
        """Return the description with this hash; None when it is unknown, or its file was damaged."""
        if sha256 not in self._known:
            try:
                self._take(sha256, read_whole(self._file(sha256)))
            except (OSError, InvalidMessage):
                return None
        return self._known.get(sha256)

    def keep(self, sha256: str, content: bytes) -> None:
        """Keep a description for later processes as well.

        Raises:
            InvalidMessage: When the content is no description.
        """
        self._take(sha256, content)
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            write_whole(self._file(sha256), content)
        except OSError as error:
            _log.warning(
                "the drawing of the robot could not be saved in %s: %s", self._folder, error.strerror
            )

    def _take(self, sha256: str, content: bytes) -> None:
        if hashlib.sha256(content).hexdigest() == sha256:
            self._known[sha256] = SceneDescription.from_bytes(content)

    def _file(self, sha256: str) -> Path:
        return self._folder / f"{sha256}.scene"


class RobotScene:
    """Description of the present robot. Used by the console's thread alone.

    Args:
        fetcher: Fetches the description.
        known: Descriptions that need not be fetched; None if the robot is not drawn.
        rate_bps: Capacity of the link [bit/s], 0 for more than enough.
    """

    def __init__(self, fetcher: BlobFetcher, known: KnownScenes | None, rate_bps: float = 0.0):
        self._fetcher, self._known = fetcher, known
        self._slow = 0.0 < rate_bps < _SKETCH_BELOW_BPS
        self._sha256, self._sketch_sha256, self._attempts = "", "", 0
        self._whole = False
        self.description: SceneDescription | None = None
        """Description of the robot, or its sketch meanwhile; None before either is known, and for a robot without one."""

    @property
    def fetching(self) -> float | None:
        """Arrived share of the description, from 0 to 1; None while it is not being fetched."""
        return self._fetcher.share(self._sha256) if self._sha256 else None

    def on_named(self, sha256: str, sketch_sha256: str = "") -> None:
        """Process the hashes of the robot's description and of its sketch; empty for none."""
        if self._known is None or not sha256 or (sha256 == self._sha256 and self.fetching is not None):
            return
        self._sha256, self._sketch_sha256, self._attempts = sha256, sketch_sha256 if self._slow else "", 0
        self._look(self._known)

    def pursue(self) -> None:
        """Fetch the description if it is unknown; retry a limited number of times. On a slow link its sketch comes first."""
        unknown = bool(self._sha256) and not self._whole and self.fetching is None
        if self._known is not None and unknown and self._attempts < _DRAWING_ATTEMPTS:
            self._attempts += 1
            wanted = [self._sha256, *([self._sketch_sha256] if self.description is None else [])]
            for sha256 in filter(None, wanted):  # the last one is fetched first
                self._fetcher.fetch(sha256, partial(self._on_content, self._known, sha256))

    def _look(self, known: KnownScenes) -> None:
        """Take the best known description."""
        whole = known.get(self._sha256)
        self._whole = whole is not None
        self.description = whole or (known.get(self._sketch_sha256) if self._sketch_sha256 else None)

    def _on_content(self, known: KnownScenes, sha256: str, content: bytes | None) -> None:
        if content is None:
            _log.warning("the drawing of the robot could not be fetched")
            return
        try:
            known.keep(sha256, content)
        except InvalidMessage as error:
            _log.warning("the drawing of the robot was not understood: %s", error)
        if sha256 in (self._sha256, self._sketch_sha256):
            self._look(known)
