"""Embodiment: all that differs between robots, in three parts that can be replaced one by one.

    hardware    what moves and what sees, at which rate, how fast
    skill       what is done at the target beyond following a model: touch, retreats, manoeuvres
    world       what only a simulation knows or can do

Supervisor, modes, motion and telemetry name no robot; they take what they need from these.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
from msgspec import UnsetType
from numpy.typing import NDArray

from farhand.common.arm.compliance import SeenReceptacle
from farhand.common.control_mode import Action, Phase
from farhand.common.model.task_frame import TaskFrame
from farhand.common.task import AnyTask
from farhand.common.wire.messages import ArmState
from farhand.common.wire.reasons import Reason
from farhand.remote_site.interface.arm_memory import ArmMemory
from farhand.remote_site.interface.goals import ManoeuvreGoal
from farhand.remote_site.interface.perception import Perception
from farhand.remote_site.interface.plant import EffectorState, Plant
from farhand.remote_site.interface.sensing import Sensing
from farhand.remote_site.reproduction.executor_settings import ExecutorSettings

Array = NDArray[np.float64]


class Guidance(NamedTuple):
    """What contact asks of the motion in one control period.

    Args:
        waits: An execution must stand still.
        back: The point to go back to before it goes on; None when it may go on. Shape (C,).
        back_m_s: How fast [m/s].
        given_up: Why it must end; None while it may go on.
        receptacle: Where the arm is to believe its receptacle; None for nothing new.
        presses: Whether the plug is to be pressed into it.
    """

    waits: bool = False
    back: Array | None = None
    back_m_s: float = 0.0
    given_up: Reason | None = None
    receptacle: SeenReceptacle | None = None
    presses: bool = False


class Belief(NamedTuple):
    """What the measurements of one control period mean.

    Args:
        frames: Where the task frames are, by sight and touch together.
        guidance: What contact asks of the motion.
    """

    frames: list[TaskFrame]
    guidance: Guidance = Guidance()


class Check(NamedTuple):
    """What was found out about a motion before it begins.

    Args:
        refusal: Why it should not begin; None when it may.
        warning: What the operator should know before; None for nothing.
    """

    refusal: Reason | None = None
    warning: Reason | None = None


class Record(Protocol):
    """How an execution went, by what only a simulation, or a measuring machine, can know."""

    def measure(self, effector: EffectorState, arrived: bool, now_s: float, dt_s: float) -> None:
        """Take one control period into account."""
        ...

    def fields(self) -> dict[str, Any]:
        """Return those fields of an `ExecutionReport` that it knows."""
        ...


class Hardware(Protocol):
    """The machine and its sight."""

    control_hz: float
    """Its control rate [Hz]."""
    settings: ExecutorSettings
    """How it executes."""
    max_speed_m_s: float
    """Of its effector, in every mode [m/s]."""

    @property
    def plant(self) -> Plant:
        """What moves."""
        ...

    @property
    def perception(self) -> Perception:
        """Its sight."""
        ...

    def arm_state(self, effector: EffectorState, overruns: int) -> ArmState | UnsetType:
        """Return what an arm reports beyond what a point does."""
        ...

    def scene(self) -> bytes:
        """Return what it looks like, see `farhand.common.wire.scene_description`; takes long, and is empty for a point."""
        ...


class Skill(Protocol):
    """What a robot does at its target beyond following a learned model."""

    @property
    def task(self) -> AnyTask:
        """The task it is at: the first of the robot's, until another one is executed."""
        ...

    @property
    def must_seat(self) -> bool:
        """Whether an execution of its task has arrived only once the tool is seated."""
        ...

    def begin(self, task: AnyTask, now_s: float) -> None:
        """Begin an execution, which makes its task the present one.

        Args:
            task: One of the robot's.
            now_s: Now [s].
        """
        ...

    def believe(self, sensing: Sensing, executing: bool, now_s: float, dt_s: float) -> Belief:
        """Return what was sensed just now means: what is felt may correct what is seen. In every mode.

        Args:
            sensing: The newest measurements.
            executing: Whether a model is executed and not paused.
            now_s: Now [s].
            dt_s: Control period [s].
        """
        ...

    def apply(self, guidance: Guidance) -> None:
        """Tell the plant what it must know of the target before it moves in this control period."""
        ...

    def confined(self, reference: Array, sensing: Sensing) -> Array:
        """Return where the effector may go of where the hand leads it; the same array where it is free."""
        ...

    def goal(self, phase: Phase, sensing: Sensing) -> ManoeuvreGoal | None:
        """Return where the manoeuvre of a phase leads from here; None when there is none."""
        ...

    def refusal(self, action: Action, sensing: Sensing) -> Reason | None:
        """Return why the robot cannot do what is asked from where it is; None when it can.

        `farhand.common.wire.reasons.in_words` makes a reason of a sentence of your own.
        """
        ...

    def end_phase(self, sensing: Sensing) -> Phase:
        """Return SEATED or ARRIVED, at the end of a motion."""
        ...

    def check(self, task: AnyTask, sensing: Sensing) -> Callable[[], Check] | None:
        """Return what examines the motion of a task from here, None for nothing.

        It takes long and is called by another thread.
        """
        ...


class World(Protocol):
    """What only a simulation knows or can do; a machine has none of it."""

    def new_record(self, task: AnyTask) -> Record:
        """Return the record of an execution that has begun."""
        ...

    def move_target(self, position_m: Array) -> None:
        """Let the simulated target go to another place, within its bounds. Shape (D,) [m]."""
        ...

    def memory(self, task: AnyTask) -> ArmMemory | None:
        """Return what a next boot must know beyond where the effector is."""
        ...


@dataclass(frozen=True)
class Embodiment:
    """One robot, as far as it is not like any other.

    Args:
        hardware: What moves and sees.
        skill: What it does at its target.
        world: What only a simulation knows.
    """

    hardware: Hardware
    skill: Skill
    world: World
