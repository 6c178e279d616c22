"""Sessions of browser tabs: one tab is active, the others watch. Anybody may stop."""

from __future__ import annotations

import threading
from enum import StrEnum


class Role(StrEnum):
    """Role of a tab."""

    ACTIVE = "active"
    WATCHING = "watching"
    FREE = "free"
    """Nobody is active: the first that acts becomes it."""


class Sessions:
    """Open tabs, by the number of their connection. Used by the server's thread and the page's."""

    def __init__(self) -> None:
        self._open: list[int] = []
        self._active: int | None = None
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
        """Add an opened tab; it becomes active when no other is."""
        with self._lock:
            self._open.append(tab)
            if self._active is None:
                self._active = tab

    def left(self, tab: int) -> bool:
        """Remove a closed tab; an active one frees its place. Return whether it was active."""
        with self._lock:
            if tab in self._open:
                self._open.remove(tab)
            was_active = self._active == tab
            if was_active:
                self._active = None
            return was_active

    def acts(self, tab: int) -> bool:
        """Decide whether this tab may act; if no tab is active, it becomes so."""
        with self._lock:
            if self._active is None and tab in self._open:
                self._active = tab
            return self._active == tab

    def role(self, tab: int) -> Role:
        """Return the role of a tab."""
        active = self._active
        if active is None:
            return Role.FREE
        return Role.ACTIVE if active == tab else Role.WATCHING
