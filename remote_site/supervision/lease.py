"""Lease: one holder controls the robot, for as long as it keeps renewing."""

from __future__ import annotations

import math
import secrets
from collections import OrderedDict, deque

from farhand.common.wire.messages import Wish
from farhand.common.wire.reasons import Code, Reason, because

_REMEMBERED = 64


class Lease:
    """Lease of the robot's control. The first request wins; silence frees it; the holder may hand it over.

    Args:
        duration_s: Silence after which it is free [s].
    """

    def __init__(self, duration_s: float):
        self._duration_s = duration_s
        self.session = ""
        """Session id of the process that holds the lease; empty when free."""
        self._renewed_s = 0.0
        self.since_s = 0.0
        """Time when the holder took it [s]."""
        self._asking: tuple[str, str, float] = ("", "", 0.0)  # session, name, when
        self._hears = False
        """True once the holder has shown that it hears the robot."""
        self._lost_s: OrderedDict[str, float] = OrderedDict()  # by session, when it had it last
        self._replaced: deque[tuple[str, str]] = deque(maxlen=_REMEMBERED)  # session and site name
        self._sessions: deque[str] = deque(maxlen=_REMEMBERED)  # in the order in which they were heard of
        self.holder = ""
        """Name of the site that holds it, empty when free."""
        self.lease_id = ""
        """Id that every motion input must carry, empty when free."""
        self.asked_by = ""
        """Name of the site that asks the holder for it, empty for none."""
        self.freed_because: Reason | None = None
        """Reason why the last holder lost it."""

    def request(
        self,
        session: str,
        site_name: str,
        now_s: float,
        wish: Wish = Wish.CONTROL,
        fresh: bool = True,
        heard_s: float | None = math.inf,
        late_s: float = 0.0,
    ) -> Reason | None:
        """Take, renew, ask for, hand over or give up the lease.

        Args:
            session: Session id of the asking process.
            site_name: Name of the asking site.
            now_s: Present time on the robot's clock [s].
            wish: Request: to take control, to ask for it, to give it away, or only to watch.
            fresh: True if the request is not late; only a fresh one lets a restarted site take its own lease back.
            heard_s: Time of the newest robot report that the site has heard [s]; None for none.
            late_s: Excess of the request's age over the usual age [s]; the renewal is that much shorter.

        Returns:
            None if the site holds the lease afterwards, else the reason of the refusal.
        """
        self.expire(now_s)
        if not session or not any(letter.isalnum() for letter in site_name):
            return because(Code.ANONYMOUS)
        if session not in self._sessions:
            self._sessions.append(session)
        if self._is_earlier(session, site_name):
            return because(Code.TAKEN_OVER, site=site_name)
        holds = bool(self.lease_id) and self.session == session
        if wish is Wish.WATCH:
            if holds:
                self._free(because(Code.ONLY_WATCHES))
            return because(Code.WATCHING)
        if holds and wish is Wish.GIVE and self.asked_by:
            asking, name, _ = self._asking
            self._grant(asking, name, now_s, hears=True)
            return because(Code.HANDED_OVER, site=name)
        if holds:
            self._renewed_s = max(self._renewed_s, now_s - late_s)
            self._hears = self._hears or heard_s is not None
            return None
        return self._take(session, site_name, now_s, wish, fresh, heard_s)

    def _take(
        self, session: str, site_name: str, now_s: float, wish: Wish, fresh: bool, heard_s: float | None
    ) -> Reason | None:
        """Grant a lease that is free or held by another process, if the rules allow; arguments as of `request`."""
        heard = heard_s is not None and heard_s > self._lost_s.get(session, -math.inf)
        if not heard and session in self._lost_s:
            return because(Code.WAITING_TO_HEAR)
        # Its own, after a restart; or from a site that hears nothing.
        may_replace = heard and fresh and (self.holder == site_name or not self._hears)
        if self.lease_id and not may_replace:
            if wish is Wish.ASK:
                self._asking, self.asked_by = (session, site_name, now_s), site_name
            return because(Code.HELD, held_s=now_s - self.since_s, site=self.holder)
        if self.lease_id:
            if self.holder == site_name:
                self._replaced.append((self.session, site_name))
            self._lose(now_s)
        self._grant(session, site_name, now_s, heard)
        return None

    def expire(self, now_s: float) -> bool:
        """Free the lease when its holder is silent for too long. Return True if this call freed it."""
        if self.asked_by and now_s - self._asking[2] > self._duration_s:
            self._forget_asking()
        if self.lease_id and now_s - self._renewed_s > self._duration_s:
            self._lose(self._renewed_s + self._duration_s)
            self._free(because(Code.NOTHING_IN_TIME, lease_s=self._duration_s))
            return True
        return False

    def is_held_by(self, session: str, lease_id: str) -> bool:
        """Decide whether a message comes from the holder."""
        return bool(lease_id) and lease_id == self.lease_id and session == self.session

    def was_replaced(self, session: str) -> bool:
        """Decide whether a later process of the same site name has taken the lease from this session."""
        return (session, self.holder) in self._replaced

    def _is_earlier(self, session: str, site_name: str) -> bool:
        """Decide whether a later process of the same site holds the lease: then this request is an old one."""
        if not self.lease_id or self.holder != site_name or self.session not in self._sessions:
            return False
        return self._sessions.index(session) < self._sessions.index(self.session)

    def _lose(self, at_s: float) -> None:
        """End the holder's lease; its session gets a lease again only after it has heard a later report."""
        self._lost_s[self.session] = at_s
        self._lost_s.move_to_end(self.session)
        if len(self._lost_s) > _REMEMBERED:
            self._lost_s.popitem(last=False)

    def _grant(self, session: str, site_name: str, now_s: float, hears: bool) -> None:
        self.session, self.holder, self._hears = session, site_name, hears
        self.since_s = self._renewed_s = now_s
        self.lease_id = secrets.token_hex(8)
        self._forget_asking()

    def _free(self, why: Reason) -> None:
        self.freed_because = why
        self.session = self.holder = self.lease_id = ""
        self._forget_asking()

    def _forget_asking(self) -> None:
        self._asking, self.asked_by = ("", "", 0.0), ""
