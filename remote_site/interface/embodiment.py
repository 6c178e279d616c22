"""Embodiment: all that differs between robots, in three parts that can be replaced separately.

    hardware    the machine and its sight, its rates and speeds
    skill       actions at the target beyond following a model: touch, retreats, manoeuvres
    world       knowledge and actions of a simulation

Supervisor, modes, motion and telemetry name no robot; they use these parts. `ArmMemory` is the stored state of a
simulated arm and its surroundings, from which the next boot continues.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple, Protocol

import numpy as np
from msgspec import Meta, Struct, UnsetType
from numpy.typing import NDArray

from farhand.common.arm.compliance import SeenReceptacle
from farhand.common.arm.robot_file import MAX_JOINTS, MIN_JOINTS
from farhand.common.mode_table import Action, Phase
from farhand.common.model.task_frame import TaskFrame
from farhand.common.task import AnyTask
from farhand.common.wire.messages import ArmState
from farhand.common.wire.reasons import Reason
from farhand.remote_site.interface.goals import ManoeuvreGoal
from farhand.remote_site.interface.plant import EffectorState, Plant
from farhand.remote_site.interface.sensing import Perception, Sensing
from farhand.remote_site.reproduction.executor_settings import ExecutorSettings, Path

Array = NDArray[np.float64]

Joints = Annotated[tuple[float, ...], Meta(min_length=MIN_JOINTS, max_length=MAX_JOINTS)]
Wrench = Annotated[tuple[float, ...], Meta(min_length=6, max_length=6)]
Pose = Annotated[tuple[float, ...], Meta(min_length=7, max_length=7)]


class ArmMemory(Struct, frozen=True, forbid_unknown_fields=True):
    """Stored state of an arm in front of its receptacle.

    Args:
        joints_rad: Joint angles [rad].
        receptacle: Resting pose of the receptacle.
        time_s: Time of the disturbances, which continue from there [s].
        tare: Zero of the wrist's sensor, kept because a plug in the bore prevents a new tare [N, Nm].
    """

    joints_rad: Joints
    receptacle: Pose
    time_s: float
    tare: Wrench


class Guidance(NamedTuple):
    """Demands of the skill on the motion in one control period.

    Args:
        waits: True if an execution must stand still.
        back: Point to retreat to before the execution continues; None if it may continue. Shape (C,).
        back_m_s: Speed of the retreat [m/s].
        given_up: Reason why the execution must end; None while it may continue.
        receptacle: Estimate of the receptacle to pass to the arm; None for no change.
        presses: True to press the plug into the receptacle.
    """

    waits: bool = False
    back: Array | None = None
    back_m_s: float = 0.0
    given_up: Reason | None = None
    receptacle: SeenReceptacle | None = None
    presses: bool = False


class Belief(NamedTuple):
    """Interpretation of one control period's measurements.

    Args:
        frames: Task frames by sight and touch together.
        guidance: Demands on the motion.
    """

    frames: list[TaskFrame]
    guidance: Guidance = Guidance()


class Check(NamedTuple):
    """Result of examining a motion before it begins.

    Args:
        refusal: Reason why the motion must not begin; None if it may.
        warning: Warning for the operator; None for none.
    """

    refusal: Reason | None = None
    warning: Reason | None = None


ExaminePath = Callable[[Path], Check]
"""Function that examines a planned motion."""


class Record(Protocol):
    """Record of an execution, with values that only a simulation or a measuring machine knows."""

    def measure(self, effector: EffectorState, arrived: bool, now_s: float, dt_s: float) -> None:
        """Record one control period."""
        ...

    def fields(self) -> dict[str, Any]:
        """Return the known fields of an `ExecutionReport`."""
        ...


class Hardware(Protocol):
    """Machine and its sight."""

    control_hz: float
    """Control rate [Hz]."""
    settings: ExecutorSettings
    """Settings of executions."""
    max_speed_m_s: float
    """Speed limit of the effector, in every mode [m/s]."""

    @property
    def plant(self) -> Plant:
        """The moving machine."""
        ...

    @property
    def perception(self) -> Perception:
        """Sight of the machine."""
        ...

    def arm_state(self, effector: EffectorState, overruns: int) -> ArmState | UnsetType:
        """Return an arm's part of the report; unset for a point."""
        ...

    def scene(self) -> bytes:
        """Return the drawing of the robot, see `farhand.common.wire.scene_description`.

        It takes long, and is empty for a point.
        """
        ...

    def sketch(self) -> bytes:
        """Return a coarse drawing of the robot for the first look over a slow link; empty for a point."""
        ...


class Skill(Protocol):
    """Actions of a robot at its target beyond following a learned model."""

    @property
    def task(self) -> AnyTask:
        """Current task: the robot's first one, until another one is executed."""
        ...

    @property
    def must_seat(self) -> bool:
        """True if an execution of the task has arrived only once the tool is seated."""
        ...

    def begin(self, task: AnyTask, now_s: float) -> None:
        """Begin an execution; its task becomes the current one.

        Args:
            task: One of the robot's tasks.
            now_s: Present time on the robot's clock [s].
        """
        ...

    def believe(self, sensing: Sensing, executing: bool, now_s: float, dt_s: float) -> Belief:
        """Interpret the newest measurements: touch may correct sight. Called in every mode.

        Args:
            sensing: The newest measurements.
            executing: True while a model is executed and not paused.
            now_s: Present time on the robot's clock [s].
            dt_s: Control period [s].
        """
        ...

    def apply(self, guidance: Guidance) -> None:
        """Tell the plant about the target before it moves in this control period."""
        ...

    def confined(self, reference: Array, sensing: Sensing) -> Array:
        """Confine the hand's reference to the region where the effector may go.

        Return the same array if the reference is in it.
        """
        ...

    def goal(self, phase: Phase, sensing: Sensing) -> ManoeuvreGoal | None:
        """Return the goal of a phase's manoeuvre from here; None if the phase has none."""
        ...

    def refusal(self, action: Action, sensing: Sensing) -> Reason | None:
        """Return the reason why the action is impossible in the robot's present state; None if it is possible."""
        ...

    def end_phase(self, sensing: Sensing) -> Phase:
        """Return the phase at the end of a motion: SEATED or ARRIVED."""
        ...

    def check(self, task: AnyTask, sensing: Sensing) -> ExaminePath | None:
        """Return a function that examines the task's planned motion from here, None for none.

        It takes long and is called by another thread.
        """
        ...


class World(Protocol):
    """Knowledge and actions of a simulation; a machine has none of them."""

    def new_record(self, task: AnyTask) -> Record:
        """Return the record of an execution that has begun."""
        ...

    def move_target(self, position_m: Array) -> None:
        """Move the simulated target, within its bounds. Shape (D,) [m]."""
        ...

    def receptacle(self) -> Array | None:
        """Return the true pose of a simulated receptacle, for a simulated camera; None for none. Shape (7,)."""
        ...

    def memory(self, task: AnyTask) -> ArmMemory | None:
        """Return the state that the next boot needs beyond the effector's position; None for none."""
        ...


@dataclass(frozen=True)
class Embodiment:
    """Parts of one robot that differ from other robots.

    Args:
        hardware: The machine and its sight.
        skill: Actions at the target.
        world: Knowledge and actions of a simulation.
    """

    hardware: Hardware
    skill: Skill
    world: World
