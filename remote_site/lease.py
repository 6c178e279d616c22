"""Who is in control of the robot: one holder, for as long as it keeps renewing."""

from __future__ import annotations

import secrets


class Lease:
    """The control of the robot. First request wins; silence frees it.

    Args:
        duration_s: Silence after which it is free [s].
    """

    def __init__(self, duration_s: float):
        self._duration_s = duration_s
        self._session = ""
        self._renewed_s = 0.0
        self.holder = ""
        """Name of the site that holds it, empty when free."""
        self.lease_id = ""
        """What every motion input must carry, empty when free."""

    def request(self, session: str, site_name: str, now_s: float) -> str:
        """Take or renew the lease.

        Returns:
            An empty string when it was granted, else why not.
        """
        self.expire(now_s)
        if self._session == session and self.lease_id:
            self._renewed_s = now_s
            return ""
        if self.lease_id:
            return f"held by {self.holder}, renewed {now_s - self._renewed_s:.1f} s ago"
        self._session, self.holder, self._renewed_s = session, site_name, now_s
        self.lease_id = secrets.token_hex(8)
        return ""

    def expire(self, now_s: float) -> bool:
        """Free the lease when its holder is silent for too long. True when it was freed just now."""
        if self.lease_id and now_s - self._renewed_s > self._duration_s:
            self._session = self.holder = self.lease_id = ""
            return True
        return False

    def is_held_by(self, session: str, lease_id: str) -> bool:
        """Whether a message comes from the holder."""
        return bool(lease_id) and lease_id == self.lease_id and session == self._session
