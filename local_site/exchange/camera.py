"""Pictures of the robot's camera: requested while the page shows them, the newest kept, their delay told to the robot."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from farhand.common.wire import keys
from farhand.common.wire.messages import CameraPicture, CameraReply, CameraRequest, Telemetry
from farhand.common.wire.reasons import Code, Reason
from farhand.local_site.exchange.report_age import LinkHealth, LinkMonitor
from farhand.local_site.exchange.requests import Requests

_PERIOD_S, _REFUSED_PERIOD_S = 1.0, 15.0
"""Times between two requests: while pictures come, and while the robot has none to send [s]."""
_LONGEST_S = 5.0
_JPEG = b"\xff\xd8\xff"


@dataclass(frozen=True)
class CameraState:
    """State of the robot's pictures.

    Args:
        wanted: True while the page shows them.
        picture: Newest picture; None before the first.
        why: The robot's reason why none comes now; None while they come.
        is_there: False if the robot has no camera, as far as is known.
        interval_s: Time between the last two pictures, at most 5 s [s].
    """

    wanted: bool = False
    picture: CameraPicture | None = None
    why: Reason | None = None
    is_there: bool = False
    interval_s: float = 1.0


class CameraWatch:
    """Follower of the robot's pictures. Used by the console's thread alone.

    Args:
        inquiries: Requests to the robot.
        monitor: State of the link.
        session: Session of this site.
        now_s: The console's clock [s].
    """

    def __init__(
        self, inquiries: Requests, monitor: LinkMonitor, session: str, now_s: Callable[[], float]
    ):  # fmt: skip
        self._inquiries, self._monitor, self._session, self._now_s = inquiries, monitor, session, now_s
        self.state = CameraState()
        """Present state."""
        self._boot, self._late_s = "", 0.0
        self._asking, self._ask_s = False, float("-inf")

    def want(self, wanted: bool) -> None:
        """Request pictures from now on, or no longer; the last one is then forgotten."""
        if wanted != self.state.wanted:
            self._show(wanted=wanted, picture=None)
            self._ask_s = float("-inf")

    def on_report(self, report: Telemetry) -> None:
        """Process a report; after the robot's restart its pictures begin again."""
        if report.stamp.boot != self._boot:
            self._boot, self._ask_s = report.stamp.boot, float("-inf")
            self._show(picture=None, why=None)

    def on_picture(self, picture: CameraPicture) -> None:
        """Process a picture; one that is no JPEG file, of another boot or older than the newest is dropped."""
        newest = self.state.picture
        if not self.state.wanted or picture.stamp.boot != self._boot or not picture.jpeg.startswith(_JPEG):
            return
        if newest is not None and picture.seq <= newest.seq:
            return
        late_s = self._monitor.late_s(picture.stamp, self._now_s()) - picture.taken_s
        self._late_s = max(self._late_s, late_s)
        interval_s = self.state.interval_s
        if newest is not None:
            interval_s = min(max(1e-9 * (picture.stamp.t_ns - newest.stamp.t_ns), 0.0), _LONGEST_S)
        self._show(picture=picture, why=None, is_there=True, interval_s=interval_s)

    def tick(self) -> None:
        """Repeat the request, while pictures are wanted and the robot is heard."""
        now_s = self._now_s()
        if not self.state.wanted or self._asking or now_s < self._ask_s:
            return
        if self._monitor.view(now_s).health in (LinkHealth.NEVER, LinkHealth.LOST):
            return
        self._asking, late_s, self._late_s = True, self._late_s, 0.0
        asked = CameraRequest(session=self._session, late_s=min(late_s, 1e6))
        self._inquiries.ask(keys.CAMERA, asked, CameraReply, 0.0, self._on_reply)

    def _on_reply(self, reply: CameraReply | None, took_s: float) -> None:
        self._asking = False
        sends = reply is None or reply.sends
        self._ask_s = self._now_s() + (max(0.0, _PERIOD_S - took_s) if sends else _REFUSED_PERIOD_S)
        if reply is not None and reply.stamp.boot == self._boot:
            is_there = reply.reason is None or reply.reason.code != Code.NO_CAMERA
            self._show(why=reply.reason, is_there=is_there)

    def _show(self, **changes: object) -> None:
        changed = replace(self.state, **changes)
        if changed != self.state:
            self.state = changed
