"""Settings of the link that change with time, once or periodically."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Mapping

import msgspec

from farhand.common.errors import InvalidConfiguration
from farhand.common.impairment.impairment import DirectionSettings, LinkSettings
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


class Timeline:
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
