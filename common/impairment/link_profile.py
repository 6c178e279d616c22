"""Named settings of the link, read from TOML."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import msgspec

from farhand.common.errors import InvalidConfiguration
from farhand.common.impairment.impairment import DirectionSettings, LinkSettings
from farhand.common.impairment.timeline import Timeline, TimelineStep, name_fields
from farhand.common.whole_file import fault_of, read_toml
from farhand.common.wire.codec import field_of


class LinkProfile(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Named kind of link."""

    source: dict[str, str]
    """Source of each figure, by its field; begins with `assumed` if nobody has measured it."""
    uplink: DirectionSettings
    """From the local site to the remote site."""
    downlink: DirectionSettings
    """From the remote site back."""
    timeline: tuple[TimelineStep, ...] = ()
    """Changes at certain times, counted from when the profile is taken."""
    repeat_s: float = 0.0
    """Period of the timeline [s]; 0 runs through it once."""

    @property
    def settings(self) -> LinkSettings:
        """The profile's two directions, without its timeline."""
        return LinkSettings(uplink=self.uplink, downlink=self.downlink)

    def over_time(self, source: str = "link") -> Timeline:
        """Return the profile's settings with its timeline.

        Raises:
            InvalidConfiguration: A step is malformed; names it. A loaded profile has none of these.
        """
        return Timeline(self.settings, self.timeline, self.repeat_s, source)


def load_profiles(path: Path) -> dict[str, LinkProfile]:
    """Read the profiles of a TOML file: one table each, whose name is the profile's.

    Raises:
        InvalidConfiguration: The file is unreadable or a profile malformed; names file and field.
    """
    with fault_of(path, InvalidConfiguration, "a TOML file in UTF-8"):
        tables = read_toml(path)
    if not tables:
        raise InvalidConfiguration(str(path), "", "expected at least one profile, such as [geo]")
    return {name: _profile_of(table, str(path), name) for name, table in tables.items()}


def find_profile(profiles: Mapping[str, LinkProfile], name: str) -> LinkProfile:
    """Return the profile with this name.

    Raises:
        InvalidConfiguration: There is none; names the known ones.
    """
    if name not in profiles:
        raise InvalidConfiguration("link", "profile", f"expected one of {', '.join(profiles)}, not {name!r}")
    return profiles[name]


def _profile_of(table: object, source: str, name: str) -> LinkProfile:
    try:
        profile = msgspec.convert(table, LinkProfile)
    except msgspec.ValidationError as error:
        path, text = field_of(error)
        where = ".".join(filter(None, [name, path]))
        raise InvalidConfiguration(source, where, name_fields(path, text)) from error
    try:
        profile.over_time()
    except InvalidConfiguration as error:
        raise InvalidConfiguration(source, f"{name}.{error.field}", error.expected) from error
    for field in sorted(_figures(profile)):
        if not profile.source.get(field):
            raise InvalidConfiguration(
                source, f"{name}.source.{field}", "expected where this figure comes from"
            )
    return profile


def _figures(profile: LinkProfile) -> set[str]:
    """Return the fields that a profile sets, without the seed, which claims nothing about the world."""
    named = [name for step in profile.timeline for name in (*step.uplink, *step.downlink)]
    directions = (msgspec.to_builtins(each) for each in (profile.uplink, profile.downlink))
    defaults = msgspec.to_builtins(DirectionSettings())
    changed = [name for each in directions for name in each if each[name] != defaults[name]]
    return {*named, *changed, *(["timeline"] if profile.timeline else [])} - {"seed"}
