"""Sessions of browser tabs: one tab is active, the others watch. Anybody may stop; another one may ask to take over."""

from __future__ import annotations

import threading
from enum import StrEnum

OBJECT_S = 5.0
"""Time in which the active tab may object to another one that asks to take over [s]."""


class Role(StrEnum):
    """Role of a tab."""

    ACTIVE = "active"
    WATCHING = "watching"
    FREE = "free"
    """No tab is active: the first that acts becomes active."""


class Sessions:
    """Open tabs, by the number of their connection. Used by the server's thread and the page's."""

    def __init__(self) -> None:
        self._open: list[int] = []
        self._active: int | None = None
        self._asked: tuple[int, float] | None = None
        """Tab that asks to take over, and when it will [s]."""
        self._lock = threading.Lock()

    @property
    def active(self) -> int | None:
        """Tab that may act."""
        return self._active

    @property
    def tabs(self) -> tuple[int, ...]:
        """All open tabs."""
        return tuple(self._open)

    def joined(self, tab: int) -> None:
        """Add an opened tab; it becomes active if no other one is."""
        with self._lock:
            self._open.append(tab)
            if self._active is None:
                self._active = tab

    def left(self, tab: int) -> bool:
        """Remove a closed tab. Return whether it was the active one."""
        with self._lock:
            if tab in self._open:
                self._open.remove(tab)
            was_active = self._active == tab
            if was_active:
                self._active = None
            if self._asked is not None and (was_active or self._asked[0] == tab):
                self._asked = None
            return was_active

    def acts(self, tab: int) -> bool:
        """Decide whether this tab may act; if no tab is active, it becomes so."""
        with self._lock:
            if self._active is None and tab in self._open:
                self._active = tab
            return self._active == tab

    def ask(self, tab: int, now_s: float) -> None:
        """Have an open tab become the active one, unless the present one objects in time.

        Args:
            tab: Number of the tab.
            now_s: Present time [s].
        """
        with self._lock:
            if self._asked is None and tab in self._open and self._active not in (None, tab):
                self._asked = tab, now_s + OBJECT_S

    def keep(self, tab: int) -> int | None:
        """Have the active tab object; return the tab that asked, None if there is nothing to object to."""
        with self._lock:
            if self._active != tab or self._asked is None:
                return None
            asker, self._asked = self._asked[0], None
            return asker

    def take_over_if_due(self, now_s: float) -> bool:
        """Make the tab that asked the active one, once nobody has objected in time. Return whether it became so."""
        with self._lock:
            if self._asked is None or now_s < self._asked[1]:
                return False
            self._active, self._asked = self._asked[0], None
            return True

    @property
    def asker(self) -> int | None:
        """Tab that asks to take over; None for none."""
        asked = self._asked
        return asked[0] if asked is not None else None

    def role(self, tab: int) -> Role:
        """Return the role of a tab."""
        active = self._active
        if active is None:
            return Role.FREE
        return Role.ACTIVE if active == tab else Role.WATCHING
