"""The tasks of one robot, and that it can be one robot that does them all."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from common.errors import InvalidConfiguration
from common.task import AnyTask

_OF_THE_ROBOT = (
    "frame_names", "limits", "n_dims", "workspace_m", "start_m", "target", "tracker", "disturbances",
)  # fmt: skip
"""What tasks say about the robot and its surroundings, not about a motion."""


class Repertoire:
    """Tasks by their names. A robot begins with the first: an arm is then where that one starts.

    Args:
        tasks: One or more.

    Raises:
        InvalidConfiguration: When there is none, two have one name, or they are not for the same robot.
    """

    def __init__(self, tasks: Sequence[AnyTask]):
        if not tasks:
            raise InvalidConfiguration("tasks", "", "one task or more")
        self._by_name = {task.name: task for task in tasks}
        if len(self._by_name) < len(tasks):
            raise InvalidConfiguration("tasks", "name", "each task once")
        self.first = tasks[0]
        for other in tasks[1:]:
            self._check(other)

    @property
    def names(self) -> tuple[str, ...]:
        """In their order."""
        return tuple(self._by_name)

    def get(self, name: str) -> AnyTask | None:
        """The task with this name, or None."""
        return self._by_name.get(name)

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
