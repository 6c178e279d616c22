"""Sending of STOP without waiting: it shares no queue, lock or thread with the console.

Even while the console is busy (learning, a slow disk, the operator's arm), a stop has been sent when `press`
returns; a separate thread resends it every 0.2 s, at first sooner, until the robot has acknowledged that it stands.
"""

from __future__ import annotations

import math
import secrets
import threading
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

from farhand.common.clock import elapsed_s
from farhand.common.link.interface import Link
from farhand.common.mode_table import Action, ControlMode
from farhand.common.wire import keys
from farhand.common.wire.codec import encode
from farhand.common.wire.messages import Stamp, Stop, StopAck, Telemetry
from farhand.local_site.exchange.reports import listen

RESEND_S = 0.2
_SOON_S, _SOON_FOR_S = 0.1, 0.5
"""Sooner at first: on a link that loses packets, a copy arrives before the loss of the one before can be known [s]."""
_LOOK_S = 0.02
_SEEN_TO_STAND_S = 3.0
"""Time after settling in which a report may still contradict a stop: after an outage old reports arrive late [s]."""
_MOVING = (ControlMode.DIRECT, ControlMode.AUTONOMOUS)


@dataclass(frozen=True)
class StopStatus:
    """Progress of this site's stop.

    Args:
        pressed_s: Time of the first unanswered press, on the site's clock [s].
        received: True once the robot has acknowledged the newest press.
        standing: True once the robot has acknowledged that it stood still after that press.
        reported: Mode in the robot's newest report made after it stood; None before such a report.
    """

    pressed_s: float
    received: bool = False
    standing: bool = False
    reported: ControlMode | None = None

    @property
    def moves_again(self) -> bool:
        """True if the robot stood for this stop but reports that it moves: another site has reset it."""
        return self.reported in _MOVING

    @property
    def settled(self) -> bool:
        """True if the robot acknowledged that it stood, and its later report says that it does not move."""
        return self.standing and self.reported is not None and not self.moves_again


class StopLane:
    """Sender of one site's stops. Every method may be called from any thread and returns at once.

    Args:
        link: Link to the robot.
        site_name: Name of the site that stops.
        now_s: The site's clock [s].
    """

    def __init__(self, link: Link, site_name: str, now_s: Callable[[], float] = elapsed_s):
        self._link, self._site_name, self._now_s = link, site_name, now_s
        self._lock = threading.Lock()  # held for a few assignments at a time, never while waiting
        self._stop_id = ""
        self._sent_s = self._newest_press_s = 0.0
        self._stood: Stamp | None = None
        self._newest: Telemetry | None = None
        self._settled_s: float | None = None
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._run, name="stop", daemon=True)
        self.status: StopStatus | None = None
        """Status of the newest stop; None before the first."""

    def listen(self) -> None:
        """Listen to the robot's acknowledgements and reports.

        Without `start`, in virtual time, the caller ticks.
        """
        hear = partial(listen, self._link, lambda job: job(), lambda _error: None)
        hear(keys.STOP_ACK, StopAck, self.acknowledged)
        hear(keys.TELEMETRY, Telemetry, self.reported)

    def start(self) -> None:
        """Start the thread that resends."""
        self._thread.start()

    def close(self) -> None:
        """End the thread, if there is one."""
        self._closed.set()
        if self._thread.is_alive():
            self._thread.join(timeout=5.0)

    def press(self) -> None:
        """Stop the robot. Each press is a new stop, and replaces an unanswered one."""
        now_s = self._now_s()
        with self._lock:
            waiting = self.status is not None and not self.status.standing
            since_s = self.status.pressed_s if self.status is not None and waiting else now_s
            self._stop_id, self._sent_s = secrets.token_hex(8), now_s
            self._newest_press_s = now_s
            self._stood = self._settled_s = None
            self.status, stop_id = StopStatus(since_s), self._stop_id
        self._send(stop_id)

    def tick(self) -> None:
        """Resend a stop until the robot has sent both acknowledgements."""
        now_s = self._now_s()
        with self._lock:
            waiting = self.status is not None and not self.status.standing
            if not waiting or now_s - self._sent_s < self._pause_s(now_s):
                return
            self._sent_s, stop_id = now_s, self._stop_id
        self._send(stop_id)

    def _pause_s(self, now_s: float) -> float:
        return _SOON_S if now_s - self._newest_press_s < _SOON_FOR_S else RESEND_S

    def commanded(self, action: Action) -> None:
        """Note a command of this site's own operator, whose reset after a settled stop needs no warning."""
        with self._lock:
            if action is Action.RESET and self.status is not None and self.status.settled:
                self._settled_s = -math.inf

    def acknowledged(self, ack: StopAck) -> None:
        """Process an acknowledgement; only those of the newest press count."""
        with self._lock:
            if self.status is None or ack.stop_id != self._stop_id:
                return
            self.status = replace(self.status, received=True, standing=self.status.standing or ack.standing)
            if ack.standing and self._stood is None:
                self._stood = ack.stamp
                if self._newest is not None and self._newest.stamp.boot == ack.stamp.boot:
                    self._compare(self._newest)

    def reported(self, report: Telemetry) -> None:
        """Process a report of the robot; ignore one older than the newest of the same boot."""
        with self._lock:
            known = self._newest
            if known is not None and known.stamp.boot == report.stamp.boot and report.seq <= known.seq:
                return
            self._newest = report
            self._compare(report)

    def _compare(self, report: Telemetry) -> None:
        """Compare the acknowledgement with the robot's present reports, until both agree."""
        status, stood, now_s = self.status, self._stood, self._now_s()
        if status is None or stood is None:
            return
        if self._settled_s is not None and now_s - self._settled_s > _SEEN_TO_STAND_S:
            return  # from here on the operator sees in the reports whether the robot moves
        if report.stamp.boot != stood.boot or report.stamp.t_ns >= stood.t_ns:
            self.status = status = replace(status, reported=report.mode)
            self._settled_s = (
                (now_s if self._settled_s is None else self._settled_s) if status.settled else None
            )

    def _send(self, stop_id: str) -> None:
        self._link.send(keys.STOP, encode(Stop(stop_id=stop_id, site_name=self._site_name)))

    def _run(self) -> None:
        while not self._closed.wait(_LOOK_S):
            self.tick()
