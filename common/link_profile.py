"""Named settings of the link, read from TOML, and changes to settings while the link runs."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import TypeVar

import msgspec

from common.codec import field_of
from common.errors import InvalidConfiguration
from common.impairment import DirectionSettings, LinkSettings

_T = TypeVar("_T")


class LinkProfile(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A kind of link."""

    source: str
    """Where the figures come from; says so where they are assumed."""
    uplink: DirectionSettings
    """From the local site to the remote site."""
    downlink: DirectionSettings
    """From the remote site back."""

    @property
    def settings(self) -> LinkSettings:
        """The profile's two directions."""
        return LinkSettings(uplink=self.uplink, downlink=self.downlink)


def load_profiles(path: Path) -> dict[str, LinkProfile]:
    """Read the profiles of a TOML file: one table each, named as the profile.

    Raises:
        InvalidConfiguration: The file is unreadable or a profile malformed; names file and field.
    """
    try:
        tables = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InvalidConfiguration(str(path), "", f"cannot be read: {error.strerror}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InvalidConfiguration(str(path), "", f"is not TOML: {error}") from error
    if not tables:
        raise InvalidConfiguration(str(path), "", "expected at least one profile, such as [geo]")
    return {name: _convert(table, LinkProfile, str(path), name) for name, table in tables.items()}


def find_profile(profiles: Mapping[str, LinkProfile], name: str) -> LinkProfile:
    """The profile of that name.

    Raises:
        InvalidConfiguration: There is none; names those there are.
    """
    if name not in profiles:
        raise InvalidConfiguration("link", "profile", f"expected one of {', '.join(profiles)}, not {name!r}")
    return profiles[name]


def update_settings(
    current: LinkSettings, *, uplink: Mapping[str, object], downlink: Mapping[str, object]
) -> LinkSettings:
    """Settings with some fields replaced; `current` stays as it is.

    Args:
        current: The settings to begin with.
        uplink: New values of fields of `DirectionSettings`.
        downlink: The same for the other direction.

    Raises:
        InvalidConfiguration: A field is unknown or its value is wrong; names the field.
    """
    merged = msgspec.to_builtins(current)
    merged["uplink"] |= uplink
    merged["downlink"] |= downlink
    return _convert(merged, LinkSettings, "link", "")


def _convert(raw: object, kind: type[_T], source: str, field: str) -> _T:
    try:
        return msgspec.convert(raw, kind)
    except msgspec.ValidationError as error:
        path, text = field_of(error)
        if "unknown field" in text and path in {"uplink", "downlink"}:
            text += f" (there are {', '.join(DirectionSettings.__struct_fields__)})"
        raise InvalidConfiguration(source, ".".join(filter(None, [field, path])), text) from error
