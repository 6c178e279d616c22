"""Tasks of one robot, checked to be tasks that one robot can do."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from farhand.common.errors import InvalidConfiguration
from farhand.common.task import AnyTask
from farhand.common.wire.messages import MOST_TASKS
from farhand.common.wire.reasons import Code, Reason, because

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
