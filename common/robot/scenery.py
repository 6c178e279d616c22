"""What is only for the eye: water, light, the sea bed, cameras."""

from __future__ import annotations

from typing import Any


def add_scenery(root: Any) -> None:
    """Add it to a scene."""
    root.worldbody.add("light", pos=(0, 0, 2))
