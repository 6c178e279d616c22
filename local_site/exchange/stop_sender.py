"""Stop, said again every 0.2 s with one id until the robot has acknowledged it twice."""

from __future__ import annotations

import secrets
from dataclasses import dataclass

from farhand.common.link.link import Link
from farhand.common.wire import keys
from farhand.common.wire.codec import encode
from farhand.common.wire.messages import Stop, StopAck

RESEND_S = 0.2


@dataclass(frozen=True)
class StopStatus:
    """How far the newest stop got.

    Args:
        pressed_s: When it was pressed, on the site's clock [s].
        received: The robot has it.
        standing: The robot stands still.
    """

    pressed_s: float
    received: bool
    standing: bool


class StopSender:
    """Sends stops of this site.

    Args:
        link: To the robot.
        site_name: Who stops.
    """

    def __init__(self, link: Link, site_name: str):
        self._link, self._site_name = link, site_name
        self._stop_id = ""
        self._sent_s = 0.0
        self.status: StopStatus | None = None

    @property
    def unacknowledged(self) -> bool:
        """Whether a stop was pressed that the robot has not confirmed with both acknowledgements."""
        return self.status is not None and not self.status.standing

    def press(self, now_s: float) -> None:
        """Stop the robot. Pressing again while one is under way resends that one at once."""
        if not self.unacknowledged:
            self._stop_id = secrets.token_hex(8)
            self.status = StopStatus(now_s, received=False, standing=False)
        self._send(now_s)

    def tick(self, now_s: float) -> None:
        """Resend what is not acknowledged."""
        if self.unacknowledged and now_s - self._sent_s >= RESEND_S:
            self._send(now_s)

    def acknowledged(self, ack: StopAck) -> None:
        """The robot answered."""
        if self.status is not None and ack.stop_id == self._stop_id:
            standing = self.status.standing or ack.standing
            self.status = StopStatus(self.status.pressed_s, received=True, standing=standing)

    def _send(self, now_s: float) -> None:
        self._sent_s = now_s
        self._link.send(keys.STOP, encode(Stop(stop_id=self._stop_id, site_name=self._site_name)))
