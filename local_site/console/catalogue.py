"""Catalogue of the robot's recordings and its drawing, requested whenever it may have changed."""

from __future__ import annotations

from farhand.common.version import installed_version
from farhand.common.wire import keys
from farhand.common.wire.messages import CatalogueReply, CatalogueRequest, Event, Telemetry
from farhand.local_site.console.robot_recordings import RobotRecordings
from farhand.local_site.exchange.fetching import BlobFetcher, KnownScenes, RobotScene
from farhand.local_site.exchange.notices import Tell
from farhand.local_site.exchange.requests import Requests
from farhand.local_site.teaching.library import Library

_GIVE_UP_S = 60.0


class RobotCatalogue:
    """Recordings and drawing of the robot. Used by the console's thread alone.

    Args:
        inquiries: Asks the robot.
        library: Learns recordings.
        site_name: Name of this site.
        tell: Tells the operator.
        rate_bps: Capacity of the link [bit/s], 0 for more than enough.
        known: Drawings that need not be fetched; None when nobody draws the robot.
    """

    def __init__(
        self,
        inquiries: Requests,
        library: Library,
        site_name: str,
        tell: Tell,
        rate_bps: float = 0.0,
        known: KnownScenes | None = None,
    ):
        self._tell = tell
        self._inquiries, fetcher = inquiries, BlobFetcher(inquiries, rate_bps)
        self.recordings = RobotRecordings(fetcher, library, site_name, tell)
        self.scene = RobotScene(fetcher, known, rate_bps)
        self.robot_version = ""
        """Version of the robot's Farhand, empty while unknown."""
        self._boot, self._listed, self._asking = "", False, False

    def on_report(self, report: Telemetry) -> None:
        """Process a report; after the robot's restart, start with an empty catalogue."""
        if report.stamp.boot != self._boot:
            if self._boot:
                self.recordings.on_restart()
            self._boot, self._listed = report.stamp.boot, False
        self.recordings.learn_arrived()
        self.scene.pursue()
        if not self._listed and not self._asking:
            self._asking = self._listed = True
            self._inquiries.ask(
                keys.CATALOGUE, CatalogueRequest(), CatalogueReply, _GIVE_UP_S, self._on_reply
            )

    def on_event(self, event: Event) -> None:
        """Process an event of the robot."""
        if self.recordings.on_event(event):
            self._listed = False

    def _on_reply(self, reply: CatalogueReply | None, _took_s: float) -> None:
        self._asking = False
        if reply is None or reply.stamp.boot != self._boot:
            self._listed = False
        elif self._listed:  # unchanged since
            self._on_version(reply.version)
            self.scene.on_named(reply.scene_sha256, reply.sketch_sha256)
            self.scene.pursue()
            self.recordings.on_offers(reply.recordings)

    def _on_version(self, version: str) -> None:
        ours = installed_version()
        if version != self.robot_version and version != ours:
            words = f"the robot runs Farhand {version or 'of an earlier version'}, this site {ours}: install the same"
            self._tell("version", words, good=False)
        self.robot_version = version
