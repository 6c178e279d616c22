"""The version of the Farhand that runs; imports nothing that takes time."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version


def installed_version() -> str:
    """Return the version of the Farhand that runs."""
    try:
        return version("farhand")
    except PackageNotFoundError:
        return "unknown"
