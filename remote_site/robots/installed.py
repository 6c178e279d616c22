"""Drivers of the user's own: found by entry points, made with their options, started, closed.

An error of theirs before the robot runs is one line that names the entry point and the remedy; later ones are the
supervisor's.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from importlib.metadata import EntryPoint, entry_points
from typing import Any, NamedTuple

from farhand.common.arm.cell import Cell
from farhand.common.errors import DriverFailed, InvalidConfiguration, InvalidInput, words_of
from farhand.common.task import AnyTask, PointTask
from farhand.remote_site.config import DriverChoice, RemoteConfig
from farhand.remote_site.interface.arm_driver import ArmDriver, check_reading
from farhand.remote_site.interface.driver import Closable, Startable, call_all
from farhand.remote_site.interface.plant import Plant, check_state
from farhand.remote_site.interface.sensing import Perception, check_frames


class DriverKind(NamedTuple):
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


PLANT = DriverKind("plant", "farhand.plants", ("read", "accelerate", "follow", "brake"))
ARM_DRIVER = DriverKind("arm_driver", "farhand.arm_drivers", ("read", "command"))
PERCEPTION = DriverKind("perception", "farhand.perceptions", ("observe",))
CAMERA = DriverKind("camera", "farhand.cameras", ("capture",))
"""Camera, which is imported and made in a process of its own alone."""
NO_CAMERA = "none"
"""Name that stands for no camera."""
_KINDS = (PLANT, ARM_DRIVER, PERCEPTION)


class Drivers(NamedTuple):
    """Drivers of the user's own; what is None is simulated.

    Args:
        plant: Machine of a point.
        arm: Machine of an arm; never without a perception.
        perception: Sight.
    """

    plant: Plant | None = None
    arm: ArmDriver | None = None
    perception: Perception | None = None


SIMULATED = Drivers()


def installed(kind: DriverKind) -> list[str]:
    """Return the names of the installed drivers of a kind."""
    return sorted({point.name for point in entry_points(group=kind.group)})


def check_drivers(config: RemoteConfig, task: AnyTask) -> None:
    """Check that the configured drivers can be found and imported, and are for this task.

    Raises:
        InvalidConfiguration: When none has that name, or the task has no such driver; names the field.
        DriverFailed: When one cannot be imported.
    """
    point = isinstance(task, PointTask)
    wrong = ARM_DRIVER if point else PLANT
    if name := wrong.choice(config).use:
        expected = f"none, as {task.name} is the task of {'a point' if point else 'an arm'}, got {name!r}"
        raise InvalidConfiguration("remote configuration", f"{wrong.field}.use", expected)
    if not point and bool(config.arm_driver.use) != bool(config.perception.use):
        lacks = PERCEPTION if config.arm_driver.use else ARM_DRIVER
        expected = "a driver as well: an arm's machine and its sight are both simulated, or neither is"
        raise InvalidConfiguration("remote configuration", f"{lacks.field}.use", expected)
    for kind in _KINDS:
        if name := kind.choice(config).use:
            _load(kind, name)
    if (name := config.camera.use) not in ("", NO_CAMERA):
        _found(CAMERA, name)


@contextmanager
def in_operation(config: RemoteConfig, task: AnyTask, cell: Cell | None, now_s: float) -> Iterator[Drivers]:
    """Make and start the configured drivers, look at their first measurements, and close all at the end.

    Args:
        config: Names and options of the drivers.
        task: The first task.
        cell: Arm in front of its receptacle; None for a point.
        now_s: Present time on the robot's clock [s].

    Raises:
        InvalidConfiguration: See `check_drivers`.
        DriverFailed: When one cannot be imported, made or started, lacks a method, or its first measurement is not of
            the agreed form.
    """
    check_drivers(config, task)
    drivers: list[Any] = []
    with ExitStack() as stack:
        for kind in _KINDS:
            driver, name = make_driver(kind, config, task, cell), kind.choice(config).use
            if isinstance(driver, Startable):
                with _told(kind, name, "cannot be started"):
                    driver.start()
            if isinstance(driver, Closable):
                stack.callback(call_all, [driver.close])
            if driver is not None:
                with _told(kind, name, "does not measure"):
                    _look(kind, driver, task, cell, now_s)
            drivers.append(driver)
        yield Drivers(*drivers)


def make_driver(kind: DriverKind, config: RemoteConfig, task: AnyTask, cell: Cell | None) -> Any:
    """Make the configured driver of a kind; None for the simulated one.

    Args:
        kind: Kind of driver.
        config: Names and options of the drivers.
        task: The first task, which a driver is made with.
        cell: Arm in front of its receptacle; the drivers of its machine and its camera are made with its robot's file.

    Raises:
        InvalidConfiguration: When none has the configured name; names the field.
        DriverFailed: When it cannot be imported or made, or lacks a method.
    """
    choice = kind.choice(config)
    if not choice.use:
        return None
    maker = _load(kind, choice.use)
    subject = cell.robot if kind in (ARM_DRIVER, CAMERA) and cell is not None else task
    with _told(kind, choice.use, f"does not take its options {choice.options}"):
        driver = maker(subject, choice.options)
    if missing := [name for name in kind.methods if not callable(getattr(driver, name, None))]:
        lacks = f"{_label(kind, choice.use)}: {type(driver).__name__} has no {', '.join(missing)}"
        raise DriverFailed(f"{lacks}: see docs/extending.md")
    return driver


def _look(kind: DriverKind, driver: Any, task: AnyTask, cell: Cell | None, now_s: float) -> None:
    """Check a first measurement."""
    if kind is PERCEPTION:
        if (frames := driver.observe(now_s)) is not None:
            check_frames(frames, len(task.frame_names), task.space.n_dims)
        return
    state = driver.read()
    if kind is ARM_DRIVER and cell is not None:
        check_reading(state, len(cell.robot.joints))
        return
    check_state(state, task.space.n_coordinates, task.space.n_tangent)
    if not state.is_plausible:
        raise InvalidInput("plant", "read", "finite numbers only, and none beyond a million")


def _load(kind: DriverKind, name: str) -> Callable[[Any, dict[str, Any]], Any]:
    point = _found(kind, name)
    with _told(kind, name, "cannot be imported"):
        return point.load()


def _found(kind: DriverKind, name: str) -> EntryPoint:
    point = _entry_point(kind, name)
    if point is None:
        known = ", ".join(installed(kind)) or "there is none: install the package that brings it along"
        expected = f"a driver that is installed (entry points {kind.group}): {known}; got {name!r}"
        raise InvalidConfiguration("remote configuration", f"{kind.field}.use", expected)
    return point


def _entry_point(kind: DriverKind, name: str) -> EntryPoint | None:
    """Return the entry point of a name; None without one.

    Raises:
        InvalidConfiguration: When two packages have the name: which one drives the machine must not be a guess.
    """
    found = {point.value: point for point in entry_points(group=kind.group, name=name)}
    if len(found) > 1:
        expected = f"a driver that one installed package has; {name!r} is {' and '.join(sorted(found))}: uninstall one"
        raise InvalidConfiguration("remote configuration", f"{kind.field}.use", expected)
    return next(iter(found.values()), None)


def _label(kind: DriverKind, name: str) -> str:
    point = _entry_point(kind, name)
    where = f" ({point.value})" if point is not None else ""
    return f"{kind.field} {name!r}{where}"


@contextmanager
def _told(kind: DriverKind, name: str, failed: str) -> Iterator[None]:
    """Tell any error of foreign code in one line with its own words."""
    try:
        yield
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # a library may also end the process or cancel its task
        remedy = f"mend the driver or its options, or choose another one with [{kind.field}] use or --{kind.field.replace('_', '-')}"
        raise DriverFailed(f"{_label(kind, name)} {failed}: {words_of(error)}; {remedy}") from error
