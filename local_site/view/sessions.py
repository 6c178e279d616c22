"""Which browser tab may act: one is active, the others watch. Anybody may stop."""

from __future__ import annotations

from enum import StrEnum


class Role(StrEnum):
    """What a tab is."""

    ACTIVE = "active"
    WATCHING = "watching"
    FREE = "free"
    """Nobody is active: the first that acts becomes it."""


class Sessions:
    """The open tabs, by the number of their connection. Used by the page's thread alone."""

    def __init__(self) -> None:
        self._open: list[int] = []
        self.active: int | None = None

    @property
    def tabs(self) -> tuple[int, ...]:
        """All open tabs."""
        return tuple(self._open)

    def joined(self, tab: int) -> None:
        """A tab was opened; it is active when no other is."""
        self._open.append(tab)
        if self.active is None:
            self.active = tab

    def left(self, tab: int) -> None:
        """A tab was closed; closing the active one frees its place."""
        if tab in self._open:
            self._open.remove(tab)
        if self.active == tab:
            self.active = None

    def acts(self, tab: int) -> bool:
        """Whether this tab may act; if nobody is active it becomes so."""
        if self.active is None and tab in self._open:
            self.active = tab
        return self.active == tab

    def role(self, tab: int) -> Role:
        """What a tab is now."""
        if self.active is None:
            return Role.FREE
        return Role.ACTIVE if self.active == tab else Role.WATCHING
