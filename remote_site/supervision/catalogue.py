"""Catalogue of what operators may fetch from the robot: its drawing, and its recordings."""

from __future__ import annotations

import hashlib

from farhand.common.version import installed_version
from farhand.common.wire.messages import BlobReply, BlobRequest, CatalogueReply, RecordingOffer, Stamp
from farhand.remote_site.supervision.motion_recorder import Recorded

_MOST_RECORDINGS = 8


class Catalogue:
    """Contents by their hash. It lives as long as the robot's process, and keeps the newest recordings only."""

    def __init__(self) -> None:
        self._scene_sha256, self._version = "", installed_version()
        self._recordings: tuple[RecordingOffer, ...] = ()
        self._contents: dict[str, bytes] = {}

    def show(self, scene: bytes) -> None:
        """Offer what the robot looks like; see `farhand.common.wire.scene_description`."""
        self._scene_sha256 = self._keep(scene)

    def offer(self, recorded: Recorded) -> None:
        """Offer a recording; the oldest one gives way."""
        sha256 = self._keep(recorded.motion.content)
        offer = RecordingOffer(sha256, recorded.site_name, recorded.whole, recorded.duration_s)
        self._recordings = (*self._recordings, offer)
        for old in self._recordings[:-_MOST_RECORDINGS]:
            del self._contents[old.sha256]
        self._recordings = self._recordings[-_MOST_RECORDINGS:]

    def list(self, now: Stamp) -> CatalogueReply:
        """Return everything that can be fetched."""
        return CatalogueReply(
            scene_sha256=self._scene_sha256, recordings=self._recordings, version=self._version, stamp=now
        )  # fmt: skip

    def part(self, request: BlobRequest, now: Stamp) -> BlobReply:
        """Return a part of a content."""
        content = self._contents.get(request.sha256, b"")
        part = content[request.offset : request.offset + request.n_bytes]
        return BlobReply(
            sha256=request.sha256, size=len(content), offset=request.offset, content=part, stamp=now
        )  # fmt: skip

    def _keep(self, content: bytes) -> str:
        sha256 = hashlib.sha256(content).hexdigest()
        self._contents[sha256] = content
        return sha256
