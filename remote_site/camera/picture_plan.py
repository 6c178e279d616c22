"""Plan of the pictures: rate and size are fitted to their share of the link, and to what the link turns out to carry."""

from __future__ import annotations

from dataclasses import dataclass

from farhand.common.errors import FarhandError
from farhand.common.link.budget import LEAST_PICTURE_BPS, OVERHEAD_BYTES, budget_bytes_s
from farhand.common.wire import keys
from farhand.common.wire.messages import CameraRequest
from farhand.common.wire.reasons import Code, Reason, because

MOST_HZ, LEAST_HZ = 3.0, 0.5
"""Rates on a wide link, and on the narrowest that carries pictures [Hz]."""
USUAL_BYTES, MOST_BYTES = 2_500, 8_000
"""Size of a picture that shows what matters, and of one that shows all [B]."""
_BESIDE_BYTES = OVERHEAD_BYTES + 230
"""Largest size of what a message has beside its picture: the stamp, the camera's place, the transport's own bytes [B]."""
_FIRST_BPS, _ENOUGH_BPS = 200_000.0, 1_000_000.0
"""Rate assumed at first for a link of unknown rate, and rate that carries the best pictures [bit/s]."""
_LATE_S, _PROMPT_S, _HOPELESS_S = 0.5, 0.2, 2.0
"""Excess of a picture's transit beyond the time that its own bytes take, from which the rate is lowered, up to which it is
raised, and from which even the lowest one is too much [s]."""
_RAISED, _LOWERED = 1.25, 0.7
_RETRY_S = 20.0
"""Time after which a link that was found too narrow is tried again [s]."""


LAPSES_S = 5.0
"""Time after a site's last request from which on nothing is sent for it: it has gone, or the link is cut [s]."""
_MOST_SITES = 64
_FIRST_PAUSE_S, _LONGEST_PAUSE_S = 1.0, 30.0
"""Pauses after a fault: the first one, and the longest to which they double [s]."""


class CameraFailed(FarhandError):
    """No picture, and the reason in words for the operator.

    Args:
        text: Reason.
        lasting: True if another attempt cannot succeed.
    """

    def __init__(self, text: str, lasting: bool = False):
        super().__init__(text)
        self.lasting = lasting


@dataclass(frozen=True)
class Fit:
    """Rate and size of the pictures.

    Args:
        period_s: Time between two pictures [s].
        most_bytes: Largest size of the JPEG file [B].
    """

    period_s: float
    most_bytes: int


def fit_pictures(rate_bps: float) -> Fit | None:
    """Return rate and size for a link; None if it carries too little for pictures.

    The pictures become more frequent up to `MOST_HZ` before they become better.

    Args:
        rate_bps: Capacity of the link [bit/s].
    """
    if rate_bps < LEAST_PICTURE_BPS:
        return None
    bytes_s = budget_bytes_s(keys.PICTURE, rate_bps)
    hz = min(max(bytes_s / (USUAL_BYTES + _BESIDE_BYTES), LEAST_HZ), MOST_HZ)
    return Fit(1.0 / hz, min(MOST_BYTES, int(bytes_s / hz) - _BESIDE_BYTES))


class LinkEstimate:
    """Estimate of the rate that the link carries: at most the configured one, less while pictures come late.

    Pictures thus make way for everything else, as a low-priority transfer does: their own queue tells it first.

    Args:
        rate_bps: Configured capacity of the link [bit/s]; 0: more than enough.
    """

    def __init__(self, rate_bps: float):
        self._most_bps = min(rate_bps or _ENOUGH_BPS, _ENOUGH_BPS)
        self._known = rate_bps > 0.0
        self.rate_bps = self._most_bps if self._known else min(_FIRST_BPS, self._most_bps)
        """Present estimate [bit/s]."""
        self._narrow_since_s: float | None = None

    def update(self, late_s: float, now_s: float) -> None:
        """Process what a site tells of the pictures that arrived.

        Args:
            late_s: Largest excess of a picture's transit over that of the quickest report [s].
            now_s: Present time [s].
        """
        fit = fit_pictures(self.rate_bps)
        if fit is None:
            return
        bits = 8.0 * (fit.most_bytes + _BESIDE_BYTES)
        excess_s = late_s - bits / self.rate_bps
        if excess_s > _HOPELESS_S and self.rate_bps <= LEAST_PICTURE_BPS:
            self.rate_bps, self._narrow_since_s = bits / late_s, now_s
        elif excess_s > _LATE_S:
            self.rate_bps = max(LEAST_PICTURE_BPS, _LOWERED * self.rate_bps)
        elif excess_s < _PROMPT_S:
            self.rate_bps = min(self._most_bps, _RAISED * self.rate_bps)

    def fit(self, now_s: float) -> Fit | None:
        """Return the present rate and size; None while the link is too narrow."""
        since_s = self._narrow_since_s
        if since_s is not None and now_s - since_s >= _RETRY_S and self._most_bps >= LEAST_PICTURE_BPS:
            self._narrow_since_s, self.rate_bps = None, LEAST_PICTURE_BPS
        return fit_pictures(self.rate_bps)

    @property
    def why_none(self) -> Reason:
        """Reason why no picture is sent over a narrow link."""
        rate_kbps, least_kbps = 1e-3 * self.rate_bps, 1e-3 * LEAST_PICTURE_BPS
        return because(Code.LINK_NARROW, rate_kbps=rate_kbps, least_kbps=least_kbps)


class PicturePlan:
    """Plan of the pictures: whether somebody looks, what the link carries, when the next one is due. Not for several threads.

    Args:
        rate_bps: Configured capacity of the link [bit/s]; 0: more than enough.
    """

    def __init__(self, rate_bps: float):
        self._estimate = LinkEstimate(rate_bps)
        self._asked_s: dict[str, float] = {}
        self._due_s = float("-inf")
        self._pause_s = 0.0
        self._lasting = False
        self.why: Reason | None = because(Code.CAMERA_STARTS)
        """Reason why the newest attempt gave no picture, or that none was made."""

    def asked(self, request: CameraRequest, now_s: float) -> None:
        """Note that a site looks, and how late its pictures come."""
        self._asked_s[request.session] = now_s
        if len(self._asked_s) > _MOST_SITES:
            del self._asked_s[min(self._asked_s, key=self._asked_s.__getitem__)]
        self._estimate.update(request.late_s, now_s)

    def why_none(self, now_s: float) -> Reason | None:
        """Return the reason why no pictures come now; None while they come."""
        return self.why if self._estimate.fit(now_s) is not None else self._estimate.why_none

    def sends(self, now_s: float) -> bool:
        """Decide whether pictures come, or attempts are made."""
        return not self._lasting and self._estimate.fit(now_s) is not None

    def due(self, now_s: float) -> tuple[Fit | None, float]:
        """Return the rate and size of a picture that is due now, or None and the time until one may be [s]."""
        fit = self._estimate.fit(now_s)
        if (
            fit is None
            or self._lasting
            or all(now_s - asked_s > LAPSES_S for asked_s in self._asked_s.values())
        ):
            return None, LAPSES_S
        return (fit, 0.0) if now_s >= self._due_s else (None, self._due_s - now_s)

    def sent(self, fit: Fit, began_s: float) -> None:
        """Note that a picture was sent; the next one follows after the period, not earlier."""
        self._due_s, self._pause_s, self.why = began_s + fit.period_s, 0.0, None

    def failed(self, error: CameraFailed, now_s: float) -> None:
        """Note that there was no picture; the pauses between attempts double."""
        self._pause_s = min(max(_FIRST_PAUSE_S, 2.0 * self._pause_s), _LONGEST_PAUSE_S)
        self._due_s, self._lasting = now_s + self._pause_s, error.lasting
        self.why = because(Code.CAMERA_FAILED, text=str(error))
