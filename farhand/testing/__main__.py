"""Check of installed drivers by their names, for their authors: `python -m farhand.testing`."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import tyro
from msgspec import structs

from farhand.common.arm.cell import Cell
from farhand.common.configuration import load_toml
from farhand.common.errors import FarhandError, InvalidConfiguration
from farhand.common.task import AnyTask, PointTask
from farhand.deploy.places import find_cell, find_task
from farhand.remote_site.config import DriverChoice, RemoteConfig
from farhand.remote_site.robots.installed import (
    ARM_DRIVER,
    CAMERA,
    NO_CAMERA,
    PERCEPTION,
    PLANT,
    DriverKind,
    make_driver,
)


@dataclass(frozen=True)
class DriverTrial:
    """Check installed drivers, each alone, and say in one line each what is wrong. A plant and an arm move: clear their way."""

    task: str = ""
    """Name of a task that comes with Farhand, or a task file; as in the file of the site when not given."""
    config: Path | None = None
    """TOML file of the robot's site, as of `farhand remote --config`; it has the drivers and their options."""
    robot: str = ""
    """Robot of an arm's task: name of one that comes with Farhand, or a robot file."""
    plant: str = ""
    """Machine of a point's task: name of an installed driver."""
    arm_driver: str = ""
    """Machine of an arm's task, in the same way."""
    perception: str = ""
    """Sight, in the same way."""
    camera: str = ""
    """Camera, in the same way."""
    at_once: bool = False
    """Do not wait for the next control period: for a simulation, whose time is its own."""

    def run(self) -> int:
        """Check the drivers; return 0 if nothing is wrong.

        Raises:
            InvalidConfiguration: When a file or a name is wrong, or no driver is named.
            DriverFailed: When one cannot be imported or made.
        """
        config = load_toml(self.config, RemoteConfig) if self.config else RemoteConfig()
        for kind in (PLANT, ARM_DRIVER, PERCEPTION, CAMERA):
            if name := getattr(self, kind.field):
                choice = DriverChoice(name, kind.choice(config).options)
                config = structs.replace(config, **{kind.field: choice})
        task = find_task((self.task or config.task).partition(",")[0])
        cell = find_cell(task, self.robot or config.robot)
        chosen = [
            kind
            for kind in (PLANT, ARM_DRIVER, PERCEPTION, CAMERA)
            if kind.choice(config).use not in ("", NO_CAMERA)
        ]
        if not chosen:
            fields = "plant, arm_driver, perception or camera"
            raise InvalidConfiguration(
                "driver check", "", f"a driver's name: {fields}, here or in the file of the site"
            )
        return max(self._check(kind, config, task, cell) for kind in chosen)

    def _check(self, kind: DriverKind, config: RemoteConfig, task: AnyTask, cell: Cell | None) -> int:
        driver = make_driver(kind, config, task, cell)
        label = f"{kind.field} {kind.choice(config).use!r}"
        try:
            _check_of(kind, task, cell, {"pace": lambda _s: None} if self.at_once else {})(driver)
        except AssertionError as findings:
            print(f"{label}:\n  " + str(findings).replace("\n", "\n  "))  # noqa: T201
            return 1
        print(f"{label}: nothing is wrong")  # noqa: T201
        return 0


def _check_of(
    kind: DriverKind, task: AnyTask, cell: Cell | None, pace: dict[str, Any]
) -> Callable[[Any], None]:
    """Return the check of a kind of driver, for a task."""
    from farhand import testing

    if kind is CAMERA:
        return testing.check_camera
    if kind is PERCEPTION:
        return partial(
            testing.check_perception, n_frames=len(task.frame_names), n_dims=task.space.n_dims, **pace
        )
    if kind is PLANT and isinstance(task, PointTask):
        limits = task.limits
        return partial(
            testing.check_plant,
            max_speed_m_s=limits.speed_m_s,
            max_acceleration_m_s2=limits.acceleration_m_s2,
            **pace,
        )
    if kind is ARM_DRIVER and cell is not None:
        return partial(testing.check_arm, robot=cell.robot, **pace)
    raise InvalidConfiguration(
        "driver check", f"{kind.field}.use", f"a driver that the task {task.name} takes"
    )


def main() -> None:
    """Run the command; what is wrong with its options is one line, and status 2."""
    try:
        status = tyro.cli(DriverTrial, prog="python -m farhand.testing").run()
    except FarhandError as error:
        print(f"farhand: {error}", file=sys.stderr)  # noqa: T201
        status = 2
    sys.exit(status)


if __name__ == "__main__":
    main()
