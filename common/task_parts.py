"""Parts of a task's file: limits, learning, frames, words, and the demonstrations that come with it."""

from __future__ import annotations

import itertools
from typing import Annotated

from msgspec import Meta, Struct

Positive = Annotated[float, Meta(gt=0)]
NonNegative = Annotated[float, Meta(ge=0)]
Text = Annotated[str, Meta(pattern=r"^[^<>&\x00-\x1f\x7f]+\Z", max_length=120)]
"""Words for the page."""
Vector = Annotated[tuple[float, ...], Meta(min_length=2, max_length=3)]


class Limits(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Limits that the robot never exceeds in this task."""

    speed_m_s: Positive = 0.6
    acceleration_m_s2: Positive = 4.0
    force_n: Positive = 250.0
    """Largest force on the tool for up to 50 ms [N]."""
    force_peak_n: Positive = 400.0
    """Largest force on the tool at any time [N]."""
    contact_n: Positive = 5.0
    """Least force on the tool in contact [N]."""


class Learning(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The two parameters of the learning."""

    max_distance_m: Positive | None = None
    """lambda: a point further away than this from all components makes a new one [m]; none: a fraction
    of the demonstrations' extent."""
    min_std_m: Positive = 0.01
    """Square root of the minimum covariance: the accuracy that the task needs [m]."""


class Target(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Simulated frame of a point's task and its motion: a plain oscillation about its mean."""

    origin_m: Vector
    amplitude_m: Vector | None = None
    """None: it stands still."""
    spread_m: Vector | None = None
    """Distance of its mean from `origin_m`, at most and per axis, in other places that a seed chooses; None: there are none."""
    period_s: Positive = 5.0
    noise_std_m: NonNegative = 0.0
    """Standard deviation of the robot's measurement of it, per axis [m]."""


class Landmark(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Frame of an arm's task that stands still in the frame of the arm's base."""

    pos_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    quat_wxyz: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if abs(sum(each**2 for each in self.quat_wxyz) - 1.0) > 1e-3:
            raise ValueError("quat_wxyz must be of unit length")


class Words(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Words of the page about a task; for None the page has the usual words of its kind."""

    target: Text | None = None
    """Name of the goal, with its article."""
    teach: Text | None = None
    """Instruction for a demonstration, without a full stop."""
    recording: Text | None = None
    """Action while a demonstration is recorded, in a few words."""
    drive: Text | None = None
    """Instruction for driving the robot, without a full stop."""
    arrived: Text | None = None
    """Advice after the arrival."""


class Sample(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Demonstration that comes with the task: a smooth stroke through some points."""

    waypoints_m: Annotated[tuple[Vector, ...], Meta(min_length=2)]
    duration_s: Annotated[float, Meta(gt=0, le=300)] = 3.0

    def __post_init__(self) -> None:
        for number, (point, following) in enumerate(itertools.pairwise(self.waypoints_m)):
            if point == following:
                raise ValueError(f"waypoints_m[{number}] and [{number + 1}] are the same point: remove one")
