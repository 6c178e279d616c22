"""What an operator can ask of the console: each a value, put into one queue with one owner."""

from __future__ import annotations

from dataclasses import dataclass

from farhand.common.control_mode import Action, ControlMode
from farhand.common.wire.messages import Wish


@dataclass(frozen=True)
class Command:
    """Ask the robot for an action.

    Args:
        action: Which.
        shown_mode: The mode that the operator saw; refused when it is no longer so. None: not checked.
        pace: For "set pace": share of the speed at which the robot's own motions were meant, 0.1 to 1.
    """

    action: Action
    shown_mode: ControlMode | None = None
    pace: float = 1.0


@dataclass(frozen=True)
class Record:
    """Begin a demonstration."""


@dataclass(frozen=True)
class End:
    """End the demonstration that is being recorded and keep what was learned."""


@dataclass(frozen=True)
class Undo:
    """Forget the demonstration that is being recorded, or else the last one."""


@dataclass(frozen=True)
class LoadSamples:
    """Learn the demonstrations that come with the task."""


@dataclass(frozen=True)
class Recover:
    """Learn the demonstration that an earlier process was recording when it ended."""


@dataclass(frozen=True)
class GoTo:
    """Have another revision of the task count.

    Args:
        revision: Its number.
    """

    revision: int


@dataclass(frozen=True)
class StartAnew:
    """Begin the task without a demonstration; what was taught can be gone back to."""


@dataclass(frozen=True)
class Delete:
    """Give up a revision that does not count.

    Args:
        revision: Its number.
    """

    revision: int


@dataclass(frozen=True)
class Choose:
    """Have teaching, previews and executions be about another task.

    Args:
        task: Its name.
    """

    task: str


@dataclass(frozen=True)
class AutoSend:
    """Send the model whenever it changes, or only when asked to.

    Args:
        on: Whether to.
    """

    on: bool


@dataclass(frozen=True)
class Control:
    """Want the control of the robot, ask its holder for it, hand it over, or watch.

    Args:
        wish: Which of them.
    """

    wish: Wish


@dataclass(frozen=True)
class SendModel:
    """Send the learned model of the chosen task to the robot."""


@dataclass(frozen=True)
class SendLibrary:
    """Send the robot of each task what it lacks."""


@dataclass(frozen=True)
class Hand:
    """The operator's hand moved: it draws, or leads the operator's arm; while coupled it drives the robot.

    Args:
        point: Where it is, in the task's space: a position on the board [m], or a pose from the arm's base.
            Length C.
        time_s: Of the motion, not of its arrival [s].
        released: It let go.
    """

    point: tuple[float, ...]
    time_s: float
    released: bool = False


@dataclass(frozen=True)
class Renew:
    """Put the operator's arm back to ready, and its receptacle elsewhere.

    Args:
        seed: Of where both are then; None: the next one.
    """

    seed: int | None = None


@dataclass(frozen=True)
class Align:
    """Turn the plug of the operator's arm, where it is, until it points along the bore."""


@dataclass(frozen=True)
class MoveTarget:
    """Move the robot's simulated target.

    Args:
        position_m: Where its mean is to be. Length D [m].
    """

    position_m: tuple[float, ...]


Send = SendModel | SendLibrary | AutoSend
Teach = Record | End | Undo | LoadSamples | Recover | GoTo | StartAnew | Delete | Renew | Align
Intent = Command | Control | Hand | MoveTarget | Choose | Send | Teach
