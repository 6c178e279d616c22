"""Named settings of the link, read from TOML.

Settings of the link that change with time, once or periodically.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Mapping
from pathlib import Path

import msgspec

from farhand.common.errors import InvalidConfiguration
from farhand.common.impairment.impairment import DirectionSettings, LinkSettings
from farhand.common.whole_file import fault_of, read_toml
from farhand.common.wire.codec import field_of

_ROUNDING_S = 1e-9
"""Tolerance within which a computed time of a change counts as reached."""


class TimelineStep(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Changes to the profile from one time to the next step."""

    at_s: float
    """Time of its beginning [s]."""
    uplink: dict[str, bool | int | float | str] = {}
    """New values of fields of `DirectionSettings`; the others are the profile's."""
    downlink: dict[str, bool | int | float | str] = {}
    """The same for the other direction."""


class LinkTimeline:
    """Settings of the link over time. Before the first step, the base settings apply.

    Args:
        base: Settings that the steps modify.
        steps: Steps in the order of their times.
        repeat_s: Period [s]; 0 leaves the last step in force.
        source: Name for errors.

    Raises:
        InvalidConfiguration: A step is malformed or out of order; names it.
    """

    def __init__(
        self,
        base: LinkSettings,
        steps: tuple[TimelineStep, ...] = (),
        repeat_s: float = 0.0,
        source: str = "link",
    ):
        self._repeat_s, self._source = _checked_period(repeat_s, steps, source), source
        self._times_s = [step.at_s for step in steps]
        self._settings = [base]
        for number, step in enumerate(steps):
            field = f"timeline[{number}]"
            earliest_s = self._times_s[number - 1] if number else 0.0
            if not earliest_s <= step.at_s < math.inf:
                expected = f"expected a time from {earliest_s:g} on, not {step.at_s}"
                raise InvalidConfiguration(source, f"{field}.at_s", expected)
            self._settings.append(
                update_settings(base, uplink=step.uplink, downlink=step.downlink, source=source, field=field)
            )

    @property
    def base(self) -> LinkSettings:
        """Settings that the steps modify."""
        return self._settings[0]

    def at(self, elapsed_s: float) -> LinkSettings:
        """Return the settings at a time after the beginning [s]."""
        return self._settings[self._place(elapsed_s)[1]]

    def next_change_s(self, elapsed_s: float) -> float | None:
        """Return the time of the next change [s after the beginning]; None if none follows."""
        begin_s, steps_taken = self._place(elapsed_s)
        if steps_taken < len(self._times_s):
            return begin_s + self._times_s[steps_taken]
        return begin_s + self._repeat_s if self._repeat_s and self._times_s else None

    def _place(self, elapsed_s: float) -> tuple[float, int]:
        """Return the beginning of the present round [s] and the number of its steps taken."""
        elapsed_s += _ROUNDING_S
        begin_s = elapsed_s // self._repeat_s * self._repeat_s if self._repeat_s else 0.0
        return begin_s, bisect_right(self._times_s, elapsed_s - begin_s)


def update_settings(
    current: LinkSettings,
    *,
    uplink: Mapping[str, object],
    downlink: Mapping[str, object],
    source: str = "link",
    field: str = "",
) -> LinkSettings:
    """Return settings with some fields replaced; `current` stays as it is.

    Args:
        current: The settings to begin with.
        uplink: New values of fields of `DirectionSettings`.
        downlink: The same for the other direction.
        source: Name for errors.
        field: Name for errors of what the fields are part of.

    Raises:
        InvalidConfiguration: A field is unknown or its value is wrong; names the field.
    """
    merged = msgspec.to_builtins(current)
    merged["uplink"] |= uplink
    merged["downlink"] |= downlink
    try:
        return msgspec.convert(merged, LinkSettings)
    except msgspec.ValidationError as error:
        path, text = field_of(error)
        where = ".".join(filter(None, [field, path]))
        raise InvalidConfiguration(source, where, name_fields(path, text)) from error


def name_fields(path: str, text: str) -> str:
    """Add the existing fields to an error that complains of an unknown one."""
    if "unknown field" in text and path.split(".")[-1] in {"uplink", "downlink"}:
        return f"{text} (there are {', '.join(DirectionSettings.__struct_fields__)})"
    return text


def _checked_period(repeat_s: float, steps: tuple[TimelineStep, ...], source: str) -> float:
    last_s = steps[-1].at_s if steps else 0.0
    if repeat_s and not last_s < repeat_s < math.inf:
        expected = f"expected 0 (once) or more than the last step's {last_s:g} s, not {repeat_s}"
        raise InvalidConfiguration(source, "repeat_s", expected)
    return repeat_s


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

    def over_time(self, source: str = "link") -> LinkTimeline:
        """Return the profile's settings with its timeline.

        Raises:
            InvalidConfiguration: A step is malformed; names it. A loaded profile has none of these.
        """
        return LinkTimeline(self.settings, self.timeline, self.repeat_s, source)


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
