"""Choice of the robot for a task."""

from __future__ import annotations

from farhand.common.arm.cell import Cell
from farhand.common.clock import BootClock
from farhand.common.errors import InvalidConfiguration
from farhand.common.task import AnyTask, PointTask
from farhand.remote_site.config import RemoteConfig
from farhand.remote_site.interface.embodiment import Embodiment
from farhand.remote_site.robots.plant_memory import PlantState
from farhand.remote_site.robots.point_embodiment import SimulatedPoint


def embodiment_of(
    task: AnyTask,
    config: RemoteConfig,
    clock: BootClock,
    remembered: PlantState | None,
    cell: Cell | None,
) -> Embodiment:
    """Return the simulated robot that a task is for.

    Args:
        task: The first task.
        config: Control rate and seed.
        clock: The robot's time.
        remembered: State in its last boot, None in its first.
        cell: Arm in front of its receptacle; None for a point.

    Raises:
        InvalidConfiguration: When the robot cannot run at the configured control rate.
    """
    if isinstance(task, PointTask):
        return SimulatedPoint(task, config, clock, remembered).embodiment
    if cell is None:
        raise InvalidConfiguration("remote configuration", "robot", f"a robot: {task.name} is an arm's task")
    from farhand.remote_site.robots.simulated_arm import SimulatedArm  # a point needs no physics

    return SimulatedArm(task, config, cell, remembered).embodiment
