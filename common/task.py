"""Task: a named skill in a file, which both sites must agree on, and the tasks of one robot."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from msgspec import Meta, Struct
from numpy.typing import NDArray

from farhand.common.configuration import load_toml
from farhand.common.errors import InvalidConfiguration
from farhand.common.model.manifold import POSE, Manifold
from farhand.common.model.task_frame import TaskFrame
from farhand.common.names import Name
from farhand.common.task_parts import (
    Landmark,
    Learning,
    Limits,
    Positive,
    Sample,
    Target,
    Vector,
    Words,
)  # fmt: skip
from farhand.common.wire.messages import MOST_FRAMES, MOST_TASKS
from farhand.common.wire.reasons import Code, Reason, because

Array = NDArray[np.float64]


class Task(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag_field="robot"):
    """Fields common to all tasks; `PointTask` and `ArmTask` add theirs."""

    name: Name
    frame_names: Annotated[tuple[Name, ...], Meta(min_length=1, max_length=MOST_FRAMES)]
    """Names of the task frames; the last one is the goal's."""
    words: Words = Words()
    require_preview: bool = False
    """Refuse an execution without a preview."""
    lost_link: Literal["continue", "hold", "retract"] = "continue"
    """Policy of an execution when the link is lost: continue, pause, or retract."""
    blind_retract: bool = False
    """Retract after a minute without sight of the target and without a link."""
    retract_m: Vector | None = None
    """Displacement of Retract from the tool's place, in the axes of the goal's frame [m].

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
        if len(set(self.frame_names)) < len(self.frame_names):
            raise ValueError("frame_names must differ")

    def _check_landmarks(self, named: Collection[str]) -> None:
        """Check that each frame but the goal's has its place."""
        if set(named) != set(self.frame_names[:-1]):
            wanted, got = (", ".join(names) or "none" for names in (self.frame_names[:-1], named))
            raise ValueError(f"landmarks must be those of frame_names but the last ({wanted}), got {got}")


class PointTask(Task, frozen=True, kw_only=True, tag="point"):
    """Task of the paper's point of unit mass, in the plane or in space."""

    n_dims: Annotated[int, Meta(ge=2, le=3)]
    workspace_m: Vector
    """Edges of the workspace, which begins at the origin [m]."""
    start_m: Vector
    """First place of the robot [m]."""
    target: Target
    """Goal's frame."""
    landmarks: dict[Name, Target] = {}
    """Other frames, by their names, as the operator's site and a simulated robot have them."""
    ready_m: Vector | None = None
    """Goal of Go to ready [m]; none: `start_m`."""
    success_rms_m: Positive = 0.01
    """Largest RMS distance to the target over 10 s after arrival for which the task succeeded [m]."""
    samples: tuple[Sample, ...] = ()
    """Demonstrations for a newcomer and for the scripted operator."""

    @property
    def targets(self) -> list[Target]:
        """Frames in the order of `frame_names`."""
        return [*(self.landmarks[name] for name in self.frame_names[:-1]), self.target]

    @property
    def varies(self) -> bool:
        """True if its frames may be at several places."""
        return any(target.spread_m is not None for target in self.targets)

    def means_m(self, seed: int) -> Array:
        """Return the mean places of the frames that a seed chooses; 0 chooses the usual ones. Shape (P, D) [m]."""
        origins = np.array([target.origin_m for target in self.targets])
        spreads = np.array([target.spread_m or (0.0,) * self.n_dims for target in self.targets])
        off = np.random.default_rng(seed).uniform(-1.0, 1.0, origins.shape) if seed else 0.0
        return np.clip(origins + off * spreads, 0.0, self.workspace_m) if self.varies else origins

    @property
    def space(self) -> Manifold:
        """Space of demonstrations, models and inputs: positions or poses."""
        return Manifold(self.n_dims)

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("workspace_m", "start_m", "ready_m"):
            if (value := getattr(self, name)) is not None and len(value) != self.n_dims:
                raise ValueError(f"{name} must have n_dims = {self.n_dims} numbers")
        self._check_landmarks(self.landmarks)
        for name, frame in (("target", self.target), *self.landmarks.items()):
            for field in ("origin_m", "amplitude_m", "spread_m"):
                if (value := getattr(frame, field)) is not None and len(value) != self.n_dims:
                    raise ValueError(f"{name}.{field} must have {self.n_dims} numbers")
        if any(len(point) != self.n_dims for sample in self.samples for point in sample.waypoints_m):
            raise ValueError(f"samples.waypoints_m: each point must have {self.n_dims} numbers")


class ArmTask(Task, frozen=True, kw_only=True, tag="arm"):
    """Task of the simulated arm with its plug, in front of a receptacle.

    Its demonstrations are poses of the tip.
    """

    skill: Literal["insert", "extract"]
    """Kind of the task: the plug is inserted or extracted."""
    tracker: Literal["clean", "typical"] = "typical"
    """Quality of the robot's sight of its receptacle."""
    disturbances: Literal["calm", "typical", "rough"] = "calm"
    """Disturbances of the receptacle, the vehicle and the water at the robot; the operator's site is calm."""
    landmarks: dict[Name, Landmark] = {}
    """Frames beside the receptacle's, which is the last, by their names."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self._check_landmarks(self.landmarks)

    @property
    def still_frames(self) -> list[TaskFrame]:
        """Frames beside the receptacle's, in the order of `frame_names`."""
        marks = (self.landmarks[name] for name in self.frame_names[:-1])
        return [TaskFrame.at(np.array([*mark.pos_m, *mark.quat_wxyz])) for mark in marks]

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
    "frame_names", "landmarks", "limits", "n_dims", "workspace_m", "start_m", "target", "tracker", "disturbances",
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
