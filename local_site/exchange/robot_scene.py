"""Drawing of the robot: known already, kept on disk, or fetched from the robot, by its hash."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from farhand.common.errors import InvalidMessage
from farhand.common.log import loop_logger
from farhand.common.whole_file import write_whole
from farhand.common.wire.scene_description import SceneDescription
from farhand.local_site.exchange.blob_fetcher import BlobFetcher

_log = loop_logger(__name__)

_ATTEMPTS = 5


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
                self._take(sha256, self._file(sha256).read_bytes())
            except (OSError, InvalidMessage):
                return None
        return self._known.get(sha256)

    def keep(self, sha256: str, content: bytes) -> None:
        """Keep a description for later processes as well.

        Raises:
            InvalidMessage: When it is no description.
        """
        self._take(sha256, content)
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            write_whole(self._file(sha256), content)
        except OSError as error:
            _log.warning("what the robot looks like is not kept in %s: %s", self._folder, error.strerror)

    def _take(self, sha256: str, content: bytes) -> None:
        if hashlib.sha256(content).hexdigest() == sha256:
            self._known[sha256] = SceneDescription.from_bytes(content)

    def _file(self, sha256: str) -> Path:
        return self._folder / f"{sha256}.scene"


class RobotScene:
    """Description of the present robot. Used by the console's thread alone.

    Args:
        fetcher: Fetches the description.
        known: Descriptions that need not be fetched; None when nobody draws the robot.
    """

    def __init__(self, fetcher: BlobFetcher, known: KnownScenes | None):
        self._fetcher, self._known = fetcher, known
        self._sha256, self._attempts = "", 0
        self.description: SceneDescription | None = None
        """It; None before it is known, and of a robot without any."""

    @property
    def fetching(self) -> float | None:
        """Share of it that has arrived, from 0 to 1; None while it is not being fetched."""
        return self._fetcher.share(self._sha256) if self._sha256 else None

    def on_named(self, sha256: str) -> None:
        """Process the hash of the robot's description; empty for none."""
        if self._known is None or not sha256 or (sha256 == self._sha256 and self.fetching is not None):
            return
        self._sha256, self._attempts = sha256, 0
        self.description = self._known.get(sha256)

    def pursue(self) -> None:
        """Fetch the description if it is unknown; retry a limited number of times."""
        unknown = bool(self._sha256) and self.description is None and self.fetching is None
        if self._known is not None and unknown and self._attempts < _ATTEMPTS:
            self._attempts += 1
            self._fetcher.fetch(self._sha256, partial(self._on_content, self._known, self._sha256))

    def _on_content(self, known: KnownScenes, sha256: str, content: bytes | None) -> None:
        if content is None:
            _log.warning("what the robot looks like could not be fetched")
            return
        try:
            known.keep(sha256, content)
        except InvalidMessage as error:
            _log.warning("what the robot looks like was not understood: %s", error)
        if sha256 == self._sha256:
            self.description = known.get(sha256)
