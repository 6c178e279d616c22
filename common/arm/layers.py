"""Which geoms touch which, and which of them are drawn."""

from __future__ import annotations

# Bits of contype and conaffinity. The arm's own links are 3 and 2, as dm_control has them.
LINK = 2
PLUG = 4

SHOWN = 2
"""Group of geoms that are drawn."""
HIDDEN = 3
"""Group of geoms that only touch."""

UNTOUCHABLE = {"contype": 0, "conaffinity": 0, "mass": 0, "group": SHOWN}
"""For geoms that are only drawn."""
