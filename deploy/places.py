"""Places of files: tasks and demonstrations that come with Farhand, the user's data folder."""

from __future__ import annotations

import os
import re
import tempfile
from pathlib import Path

from farhand.common.arm.cell import Cell
from farhand.common.arm.robot_file import RobotFile, load_robot
from farhand.common.errors import InvalidConfiguration
from farhand.common.names import PATTERN, default_site_name, user_path
from farhand.common.task import AnyTask, PointTask, TaskSet, load_task

_REMEDY = "a folder that can be written, which --data-dir or the variable XDG_DATA_HOME names"
_TASKS = Path(__file__).with_name("tasks")
_SAMPLES = Path(__file__).with_name("samples")
_ROBOTS = Path(__file__).with_name("robots")
_FORMER_NAMES = {"hot-unstab": "hot-stab-removal"}


def find_task(name_or_file: str) -> AnyTask:
    """Return a task by the name of one that comes with Farhand, or by its file.

    Raises:
        InvalidConfiguration: When there is none, or it is malformed.
    """
    return load_task(_file_of("task", _TASKS, _FORMER_NAMES.get(name_or_file, name_or_file)))


def find_tasks(names: str) -> TaskSet:
    """Return the tasks of one robot, by names or files with commas between them.

    Raises:
        InvalidConfiguration: When there is none, one is malformed, or they are not for the same robot.
    """
    return TaskSet([find_task(name.strip()) for name in names.split(",")])


def find_point_task(name_or_file: str) -> PointTask:
    """Return a task like `find_task`, for uses that only a point supports.

    Raises:
        InvalidConfiguration: As in `find_task`, and when the task is for another robot.
    """
    task = find_task(name_or_file)
    if not isinstance(task, PointTask):
        raise InvalidConfiguration("task", "robot", f'"point", got the task of another robot, {task.name!r}')
    return task


def find_robot(name_or_file: str) -> RobotFile:
    """Return a robot by the name of one that comes with Farhand, or by its file.

    Args:
        name_or_file: Name or file; empty: the robot that the file `default` beside them names.

    Raises:
        InvalidConfiguration: When there is none, or it is malformed.
    """
    name_or_file = name_or_file or (_ROBOTS / "default").read_text(encoding="utf-8").strip()
    return load_robot(_file_of("robot", _ROBOTS, name_or_file))


def robot_names() -> list[str]:
    """Return the names of the robots that come with Farhand."""
    return _names(_ROBOTS)


def _names(folder: Path) -> list[str]:
    return sorted(file.stem for file in folder.glob("*.toml"))


def _file_of(kind: str, folder: Path, name_or_file: str) -> Path:
    """Return a file as given, or the one of that name among those that come with Farhand.

    Raises:
        InvalidConfiguration: When there is no such name.
    """
    path = Path(name_or_file)
    if path.suffix == ".toml":
        return path
    path = folder / f"{name_or_file}.toml"
    if not re.match(PATTERN, name_or_file) or not path.is_file():
        known = ", ".join(_names(folder))
        raise InvalidConfiguration(kind, "", f"{known}, or a .toml file; got {name_or_file!r}")
    return path


def find_cell(task: AnyTask, robot: str = "") -> Cell | None:
    """Return the arm with its receptacle that a task is for, None for the task of a point.

    Args:
        task: A task of the robot.
        robot: Name or file of the robot, see `find_robot`.

    Raises:
        InvalidConfiguration: When there is no such robot, it does not fit its model, or it is named for a point.
    """
    if isinstance(task, PointTask):
        if robot:
            raise InvalidConfiguration(
                "robot", "", f"none, as {task.name} is the task of a point, got {robot!r}"
            )
        return None
    from farhand.common.arm.robot_model import arm_spec  # the physics take a second to import

    cell = Cell(robot=find_robot(robot))
    arm_spec(cell.robot)
    return cell


def sample_files(task_name: str) -> list[Path]:
    """Return the demonstration files that come with a task; some tasks have none.

    `farhand samples` made them.
    """
    return sorted(_SAMPLES.glob(f"{task_name}-[0-9]*.npz"))


def check_writable(field: str, file: Path) -> None:
    """Refuse a file that cannot be written, before the work whose result it is for.

    Args:
        field: Name of the option that gave the file.
        file: File that will be written.

    Raises:
        InvalidConfiguration: When the file's folder does not exist, or the user may not write the file.
    """
    if file.is_dir() or not os.access(file if file.exists() else file.parent, os.W_OK):
        raise InvalidConfiguration(
            "command line", field, f"a file that can be written, in a folder that exists; got {file}"
        )


def site_name(folder: Path) -> str:
    """Return the name of an operator's site that was given none, by its data folder, see `default_site_name`."""
    try:
        usual = _usual_folder()
    except RuntimeError:  # a user without a home has no usual folder
        usual = Path(os.devnull)
    return default_site_name(folder, usual)


def _usual_folder() -> Path:
    return (Path(os.environ.get("XDG_DATA_HOME") or "~/.local/share") / "farhand").expanduser()


def data_folder(chosen: str | Path | None) -> Path:
    """Return the chosen folder, or the user's data folder for Farhand; made when it is missing.

    Raises:
        InvalidConfiguration: When the user has no home, or the folder cannot be written.
    """
    try:
        folder = user_path(chosen, "data_dir") if chosen else _usual_folder()
    except RuntimeError as error:
        raise InvalidConfiguration("data_dir", "", f"{_REMEDY}, as this user has no home") from error
    try:
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError as error:
        raise InvalidConfiguration("data_dir", "", f"{_REMEDY}; {folder}: {error.strerror}") from error
    return folder
