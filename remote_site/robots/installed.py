"""Drivers of the user's own: found by entry points, made with their options, started, closed.

An error of theirs before the robot runs is one line that names the entry point and the remedy; later ones are the
supervisor's.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from importlib.metadata import EntryPoint, entry_points
from typing import Any, NamedTuple

from farhand.common.errors import DriverFailed, InvalidConfiguration, InvalidInput
from farhand.common.task import AnyTask, PointTask
from farhand.remote_site.config import DriverChoice, RemoteConfig
from farhand.remote_site.interface.driver import Closable, Startable, call_all
from farhand.remote_site.interface.embodiment import Hardware
from farhand.remote_site.interface.plant import check_state
from farhand.remote_site.interface.sensing import check_frames


class Kind(NamedTuple):
    """Kind of driver.

    Args:
        field: Its field in the configuration, and its option.
        group: Group of its entry points.
        methods: Methods that it must have.
    """

    field: str
    group: str
    methods: tuple[str, ...]

    def choice(self, config: RemoteConfig) -> DriverChoice:
        """Return the configured driver of this kind."""
        return getattr(config, self.field)


PLANT = Kind("plant", "farhand.plants", ("read", "accelerate", "follow", "brake"))
PERCEPTION = Kind("perception", "farhand.perceptions", ("observe",))
_OF_A_POINT = (PLANT, PERCEPTION)


def installed(kind: Kind) -> list[str]:
    """Return the names of the installed drivers of a kind."""
    return sorted({point.name for point in entry_points(group=kind.group)})


def check_drivers(config: RemoteConfig, task: AnyTask) -> None:
    """Check that the configured drivers can be found and imported, and are for this task.

    Raises:
        InvalidConfiguration: When none has that name, or the task has no such driver; names the field.
        DriverFailed: When one cannot be imported.
    """
    for kind in _OF_A_POINT:
        if not (name := kind.choice(config).use):
            continue
        if not isinstance(task, PointTask):
            expected = f"none, as {task.name} is the task of an arm, got {name!r}"
            raise InvalidConfiguration("remote configuration", f"{kind.field}.use", expected)
        _load(kind, name)


def make(kind: Kind, config: RemoteConfig, task: AnyTask) -> Any:
    """Make the configured driver of a kind; None for the simulated one.

    Raises:
        InvalidConfiguration: When none has that name.
        DriverFailed: When it cannot be imported or made, or lacks a method.
    """
    choice = kind.choice(config)
    if not choice.use:
        return None
    maker = _load(kind, choice.use)
    with _told(kind, choice.use, f"does not take its options {choice.options}"):
        driver = maker(task, choice.options)
    if missing := [name for name in kind.methods if not callable(getattr(driver, name, None))]:
        lacks = f"{_label(kind, choice.use)}: {type(driver).__name__} has no {', '.join(missing)}"
        raise DriverFailed(f"{lacks}: see docs/extending.md")
    return driver


@contextmanager
def in_operation(hardware: Hardware, config: RemoteConfig, task: AnyTask, now_s: float) -> Iterator[None]:
    """Start the drivers of a robot, look at the first measurements of the user's own, and close all at the end.

    Args:
        hardware: Plant and perception.
        config: Names of the drivers.
        task: The first task.
        now_s: Present time on the robot's clock [s].

    Raises:
        DriverFailed: When one cannot be started, or its first measurement is not of the agreed form.
    """
    drivers = dict(zip(_OF_A_POINT, (hardware.plant, hardware.perception), strict=True))
    with ExitStack() as stack:
        for kind, driver in drivers.items():
            if isinstance(driver, Startable):
                with _told(kind, kind.choice(config).use, "cannot be started"):
                    driver.start()
            if isinstance(driver, Closable):
                stack.callback(call_all, [driver.close])
        for kind, driver in drivers.items():
            if name := kind.choice(config).use:
                with _told(kind, name, "does not measure"):
                    _look(kind, driver, task, now_s)
        yield


def _look(kind: Kind, driver: Any, task: AnyTask, now_s: float) -> None:
    """Check a first measurement."""
    if kind is PLANT:
        state = driver.read()
        check_state(state, task.space.n_coordinates, task.space.n_tangent)
        if not state.is_finite:
            raise InvalidInput("plant", "read", "finite numbers only")
    elif (frames := driver.observe(now_s)) is not None:
        check_frames(frames, len(task.frame_names), task.space.n_dims)


def _load(kind: Kind, name: str) -> Callable[[AnyTask, dict[str, Any]], Any]:
    point = _entry_point(kind, name)
    if point is None:
        known = ", ".join(installed(kind)) or "there is none: install the package that brings it along"
        expected = f"a driver that is installed (entry points {kind.group}): {known}; got {name!r}"
        raise InvalidConfiguration("remote configuration", f"{kind.field}.use", expected)
    with _told(kind, name, "cannot be imported"):
        return point.load()


def _entry_point(kind: Kind, name: str) -> EntryPoint | None:
    return next(iter(entry_points(group=kind.group, name=name)), None)


def _label(kind: Kind, name: str) -> str:
    point = _entry_point(kind, name)
    where = f" ({point.value})" if point is not None else ""
    return f"{kind.field} {name!r}{where}"


@contextmanager
def _told(kind: Kind, name: str, failed: str) -> Iterator[None]:
    """Tell any error of foreign code in one line with its own words."""
    try:
        yield
    except (Exception, SystemExit) as error:
        said = f"{type(error).__name__}: {error}"
        remedy = (
            f"mend the driver or its options, or choose another one with [{kind.field}] use or --{kind.field}"
        )
        raise DriverFailed(f"{_label(kind, name)} {failed}: {said}; {remedy}") from error
