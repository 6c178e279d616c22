"""Task: a named skill in a file, which both sites must agree on, and the tasks of one robot."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated, Literal, TypeVar

from msgspec import Meta, Struct

from farhand.common.configuration import load_toml
from farhand.common.errors import InvalidConfiguration
from farhand.common.model.manifold import POSE, Manifold
from farhand.common.names import Name
from farhand.common.wire.messages import MOST_TASKS
from farhand.common.wire.reasons import Code, Reason, because

Positive = Annotated[float, Meta(gt=0)]
NonNegative = Annotated[float, Meta(ge=0)]
Vector = Annotated[tuple[float, ...], Meta(min_length=2, max_length=3)]
S = TypeVar("S", bound=Struct)


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
    """Simulated target and its motion: a plain oscillation about its mean."""

    origin_m: Vector
    amplitude_m: Vector
    period_s: Positive = 5.0
    noise_std_m: NonNegative = 0.0
    """Standard deviation of the robot's measurement of it, per axis [m]."""


class Sample(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Demonstration that comes with the task: a smooth stroke through some points."""

    waypoints_m: Annotated[tuple[Vector, ...], Meta(min_length=2)]
    duration_s: Annotated[float, Meta(gt=0, le=300)] = 3.0

    def __post_init__(self) -> None:
        for number, (point, following) in enumerate(itertools.pairwise(self.waypoints_m)):
            if point == following:
                raise ValueError(f"waypoints_m[{number}] and [{number + 1}] are the same point: remove one")


class Task(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag_field="robot"):
    """Fields common to all tasks; `PointTask` and `ArmTask` add theirs."""

    name: Name
    frame_names: Annotated[tuple[Name, ...], Meta(min_length=1, max_length=8)]
    require_preview: bool = False
    """Refuse an execution without a preview."""
    lost_link: Literal["continue", "hold", "retract"] = "continue"
    """Policy of an execution when the link is lost: continue, pause, or retract."""
    blind_retract: bool = False
    """Retract after a minute without sight of the target and without a link."""
    retract_m: Vector | None = None
    """Displacement of Retract from the tool's place, in the axes of the first task frame [m].

    None: no Retract.
    """
    learning: Learning = Learning()
    limits: Limits = Limits()

    @property
    def space(self) -> Manifold:
        """Space of demonstrations, models and inputs: positions or poses."""
        raise NotImplementedError

    def __post_init__(self) -> None:
        if self.retract_m is not None and len(self.retract_m) != self.space.n_dims:
            raise ValueError(f"retract_m must have {self.space.n_dims} numbers")
        if self.retract_m is None and (self.lost_link == "retract" or self.blind_retract):
            raise ValueError('retract_m is needed for lost_link = "retract" and for blind_retract')


class PointTask(Task, frozen=True, kw_only=True, tag="point"):
    """Task of the paper's point of unit mass, in the plane or in space."""

    n_dims: Annotated[int, Meta(ge=2, le=3)]
    workspace_m: Vector
    """Edges of the workspace, which begins at the origin [m]."""
    start_m: Vector
    """First place of the robot [m]."""
    target: Target
    ready_m: Vector | None = None
    """Goal of Go to ready [m]; none: `start_m`."""
    success_rms_m: Positive = 0.01
    """Largest RMS distance to the target over 10 s after arrival for which the task succeeded [m]."""
    samples: tuple[Sample, ...] = ()
    """Demonstrations for a newcomer and for the scripted operator."""

    @property
    def space(self) -> Manifold:
        """Space of demonstrations, models and inputs: positions or poses."""
        return Manifold(self.n_dims)

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("workspace_m", "start_m", "ready_m"):
            if (value := getattr(self, name)) is not None and len(value) != self.n_dims:
                raise ValueError(f"{name} must have n_dims = {self.n_dims} numbers")
        if not len(self.target.origin_m) == len(self.target.amplitude_m) == self.n_dims:
            raise ValueError(f"target.origin_m and target.amplitude_m must have {self.n_dims} numbers")
        if any(len(point) != self.n_dims for sample in self.samples for point in sample.waypoints_m):
            raise ValueError(f"samples.waypoints_m: each point must have {self.n_dims} numbers")


class ArmTask(Task, frozen=True, kw_only=True, tag="arm"):
    """Task of the simulated arm with its plug, in front of a receptacle.

    Its demonstrations are poses of the tip.
    """

    skill: Literal["insert", "extract"]
    """Whether the plug is inserted or extracted."""
    tracker: Literal["clean", "typical"] = "typical"
    """Quality of the robot's sight of its receptacle."""
    disturbances: Literal["calm", "typical", "rough"] = "calm"
    """Disturbances of the receptacle, the vehicle and the water at the robot; the operator's site is calm."""

    @property
    def space(self) -> Manifold:
        """Space of demonstrations, models and inputs: positions or poses."""
        return POSE


AnyTask = PointTask | ArmTask
_ANY_TASK: type[AnyTask] = AnyTask  # pyright: ignore[reportAssignmentType]


def load_task(path: Path) -> AnyTask:
    """Read a task from a file; its `robot` names the kind. See `load_toml` for the errors."""
    return load_toml(path, _ANY_TASK)


_OF_THE_ROBOT = (
    "frame_names", "limits", "n_dims", "workspace_m", "start_m", "target", "tracker", "disturbances",
)  # fmt: skip
"""Fields of tasks about the robot and its surroundings rather than about a motion."""


class TaskSet:
    """Tasks by their names. A robot begins with the first task: an arm starts where that task starts.

    Args:
        tasks: 1 to `MOST_TASKS`.

    Raises:
        InvalidConfiguration: When there is none or too many, two have one name, or they are for different
            robots.
    """

    def __init__(self, tasks: Sequence[AnyTask]):
        if not 1 <= len(tasks) <= MOST_TASKS:
            raise InvalidConfiguration(
                "tasks", "", f"one task or more, {MOST_TASKS} at most; got {len(tasks)}"
            )
        self._by_name = {task.name: task for task in tasks}
        if len(self._by_name) < len(tasks):
            raise InvalidConfiguration("tasks", "name", "each task once")
        self.first = tasks[0]
        for other in tasks[1:]:
            self._check(other)

    @property
    def names(self) -> tuple[str, ...]:
        """Names in order."""
        return tuple(self._by_name)

    def get(self, name: str) -> AnyTask | None:
        """Return the task with this name, or None."""
        return self._by_name.get(name)

    def refusal(self, name: str) -> Reason | None:
        """Return the reason why the robot does not do a task with this name; None if it does."""
        return None if name in self._by_name else because(Code.OTHER_TASK, does=self.names, task=name)

    def __iter__(self) -> Iterator[AnyTask]:
        return iter(self._by_name.values())

    def __len__(self) -> int:
        return len(self._by_name)

    def _check(self, other: AnyTask) -> None:
        if type(other) is not type(self.first):
            expected = f"the robot of {self.first.name!r}, so that one robot does both"
            raise InvalidConfiguration(f"task {other.name!r}", "robot", expected)
        for field in _OF_THE_ROBOT:
            theirs, ours = getattr(other, field, None), getattr(self.first, field, None)
            if theirs != ours:
                expected = f"{ours!r} as in {self.first.name!r}, so that one robot does both; got {theirs!r}"
                raise InvalidConfiguration(f"task {other.name!r}", field, expected)
