"""Choice of the robot for a task."""

from __future__ import annotations

from farhand.common.arm.cell import Cell
from farhand.common.clock import BootClock
from farhand.common.errors import InvalidConfiguration
from farhand.common.task import AnyTask, PointTask
from farhand.remote_site.config import RemoteConfig
from farhand.remote_site.interface.embodiment import Embodiment
from farhand.remote_site.robots.installed import SIMULATED, Drivers
from farhand.remote_site.robots.plant_memory import PlantState
from farhand.remote_site.robots.point_embodiment import SimulatedPoint, point_embodiment


def embodiment_of(
    task: AnyTask,
    config: RemoteConfig,
    clock: BootClock,
    remembered: PlantState | None,
    cell: Cell | None,
    drivers: Drivers = SIMULATED,
) -> Embodiment:
    """Return the robot that a task is for; what has no driver of the user's own is simulated.

    Args:
        task: The first task.
        config: Control rate and seed.
        clock: The robot's time.
        remembered: State in its last boot, None in its first.
        cell: Arm in front of its receptacle; None for a point.
        drivers: Drivers of the user's own, started.

    Raises:
        InvalidConfiguration: When the robot cannot run at the configured control rate.
    """
    if isinstance(task, PointTask):
        plant, sight = drivers.plant, drivers.perception
        point = SimulatedPoint(task, config, clock, remembered)
        simulated = point.embodiment.hardware
        if plant is None and sight is None:
            return point.embodiment
        return point_embodiment(
            task, plant or simulated.plant, sight or simulated.perception, simulated.control_hz,
            world=point if sight is None else None,
        )  # fmt: skip
    if cell is None:
        raise InvalidConfiguration("remote configuration", "robot", f"a robot: {task.name} is an arm's task")
    if drivers.arm is not None and drivers.perception is not None:
        from farhand.remote_site.robots.driven_arm import DrivenArm

        return DrivenArm(task, config, cell, drivers.arm, drivers.perception).embodiment
    from farhand.remote_site.robots.simulated_arm import SimulatedArm  # a point needs no physics

    return SimulatedArm(task, config, cell, remembered).embodiment
