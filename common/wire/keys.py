"""Table of Zenoh key expressions and their quality of service. A fixed set; ids are sent in payloads.

All keys are below the vehicle's name, which is the session's namespace. Those to the robot name the site that sends:
the robot binds them to the name in its certificate.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from farhand.common.wire.messages import MAX_BYTES, MAX_PICTURE_BYTES, MOST_CONTENT_BYTES

_SMALL_BYTES = 2048
"""Largest size of a message without bulk content [B]: names and a few numbers."""


class Urgency(Enum):
    """Order in which the transport serves waiting messages; the values are the transport's names."""

    STOP = "REAL_TIME"
    COMMAND = "INTERACTIVE_HIGH"
    STREAM = "INTERACTIVE_LOW"
    TELEMETRY = "DATA_HIGH"
    EVENT = "DATA"
    BULK = "DATA_LOW"
    PICTURE = "BACKGROUND"


@dataclass(frozen=True)
class Channel:
    """Flow between the sites.

    Args:
        key: Key expression below the vehicle's name; the site's name is left out, see `of`.
        urgency: Urgency of its messages.
        must_arrive: Wait for room in a full queue (True), or drop the newest (False).
        most_bytes: Largest size of a message [B]; a larger one is dropped unread.
        both_ways: Send copies as datagrams beside the one that the transport resends: it must arrive soon.
    """

    key: str
    urgency: Urgency
    must_arrive: bool
    most_bytes: int = _SMALL_BYTES
    both_ways: bool = False

    def of(self, site: str) -> str:
        """Return the key of a site's messages on this channel.

        Args:
            site: Name of the operator's site; `*` for all of them.
        """
        return f"op/{site}/{self.key[3:]}" if self.is_to_robot else self.key

    @property
    def is_to_robot(self) -> bool:
        """True for what operators send."""
        return self.key.startswith("op/")

    @property
    def is_streamed(self) -> bool:
        """True if a lost message is not resent, because the next one replaces it."""
        return not self.must_arrive and not self.is_large

    @property
    def is_large(self) -> bool:
        """True if its messages need many packets, which travel as a stream that everything else overtakes."""
        return self.urgency in (Urgency.BULK, Urgency.PICTURE)


ALIVE = "alive"
"""Key of the token by which a robot at a hub is found."""


def answers_for(site: str, asker: str) -> str:
    """Return the key of the robot's answers to the copies of a site's questions.

    Args:
        site: Name of the operator's site; `*` for all of them.
        asker: Random name of the asking process; `*` for all of them.
    """
    return f"op/{site}/answer/{asker}"


# From the operator
STOP = Channel("op/stop", Urgency.STOP, must_arrive=True, both_ways=True)
COMMAND = Channel("op/cmd", Urgency.COMMAND, must_arrive=True, both_ways=True)
LEASE = Channel("op/lease", Urgency.COMMAND, must_arrive=True, both_ways=True)
INPUT = Channel("op/pose", Urgency.STREAM, must_arrive=False)
HEARTBEAT = Channel("op/hb", Urgency.STREAM, must_arrive=False)
TARGET = Channel("op/target", Urgency.EVENT, must_arrive=True)
MODEL = Channel("op/model", Urgency.BULK, must_arrive=True, most_bytes=MOST_CONTENT_BYTES + _SMALL_BYTES)
REPORT = Channel("op/report", Urgency.EVENT, must_arrive=True)
EVENTS = Channel("op/events", Urgency.EVENT, must_arrive=True)
CATALOGUE = Channel("op/catalogue", Urgency.EVENT, must_arrive=True)
BLOB = Channel("op/blob", Urgency.BULK, must_arrive=True)
CAMERA = Channel("op/camera", Urgency.EVENT, must_arrive=True)

RIGHT = Channel("op/right", Urgency.EVENT, must_arrive=True)
"""Question for the rights of a site, which the robot's end of the link itself answers, even to a site without any."""

# From the robot
STOP_ACK = Channel("rov/stop/ack", Urgency.STOP, must_arrive=True, both_ways=True)
TELEMETRY = Channel("rov/tele/state", Urgency.TELEMETRY, must_arrive=False)
TELEMETRY_BY_STOPS = Channel("rov/tele/state/stops", Urgency.TELEMETRY, must_arrive=False)
TELEMETRY_BY_MAIN = Channel("rov/tele/state/main", Urgency.TELEMETRY, must_arrive=False)
EVENT = Channel("rov/event", Urgency.EVENT, must_arrive=True, most_bytes=MAX_BYTES)
PATH = Channel("rov/path", Urgency.BULK, must_arrive=False, most_bytes=MAX_BYTES)
PICTURE = Channel(
    "rov/picture", Urgency.PICTURE, must_arrive=False, most_bytes=MAX_PICTURE_BYTES + _SMALL_BYTES
)

REPORTS = (TELEMETRY, TELEMETRY_BY_STOPS, TELEMETRY_BY_MAIN)
"""Channels of the robot's reports; in a silence the link moves reports to the others, over its other connections."""

OBSERVERS = (STOP, HEARTBEAT, REPORT, EVENTS, CATALOGUE, BLOB, CAMERA)
"""Channels on which a site may send that has the right to watch and stop only."""

ALL = (
    STOP,
    COMMAND,
    LEASE,
    INPUT,
    HEARTBEAT,
    TARGET,
    MODEL,
    REPORT,
    EVENTS,
    CATALOGUE,
    BLOB,
    CAMERA,
    STOP_ACK,
    TELEMETRY,
    EVENT,
    PATH,
    PICTURE,
)
"""All channels of the sites; the others belong to the link itself."""
