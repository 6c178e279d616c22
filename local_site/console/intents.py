"""What an operator can ask of the console: each a value, put into one queue with one owner."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from farhand.common.control_mode import Action, ControlMode
from farhand.common.wire.messages import Wish


@dataclass(frozen=True)
class CommandRobot:
    """Ask the robot for an action.

    Args:
        action: Which.
        shown_mode: The mode that the operator saw; refused when it is no longer so. None: not checked.
        pace: For "set pace": share of the speed at which the robot's own motions were meant, 0.1 to 1.
    """

    action: Action
    shown_mode: ControlMode | None = None
    pace: float = 1.0

    @property
    def label(self) -> str:
        """The name under which events tell of the intent."""
        return str(self.action)


@dataclass(frozen=True)
class RecordDemonstration:
    """Begin a demonstration."""

    label: ClassVar[str] = "record"


@dataclass(frozen=True)
class EndDemonstration:
    """End the demonstration that is being recorded and keep what was learned."""

    label: ClassVar[str] = "end"


@dataclass(frozen=True)
class Undo:
    """Forget the demonstration that is being recorded, or else the last one."""

    label: ClassVar[str] = "undo"


@dataclass(frozen=True)
class LoadSamples:
    """Learn the demonstrations that come with the task."""

    label: ClassVar[str] = "load samples"


@dataclass(frozen=True)
class Recover:
    """Learn the demonstration that an earlier process was recording when it ended."""

    label: ClassVar[str] = "recover"


@dataclass(frozen=True)
class SelectRevision:
    """Have another revision of the task count.

    Args:
        revision: Its number.
    """

    label: ClassVar[str] = "go to"

    revision: int


@dataclass(frozen=True)
class StartAnew:
    """Begin the task without a demonstration; what was taught can be gone back to."""

    label: ClassVar[str] = "start anew"


@dataclass(frozen=True)
class Delete:
    """Give up a revision that does not count.

    Args:
        revision: Its number.
    """

    label: ClassVar[str] = "delete"

    revision: int


@dataclass(frozen=True)
class Choose:
    """Have teaching, previews and executions be about another task.

    Args:
        task: Its name.
    """

    label: ClassVar[str] = "choose"

    task: str


@dataclass(frozen=True)
class AutoSend:
    """Send the model whenever it changes, or only when asked to.

    Args:
        on: Whether to.
    """

    label: ClassVar[str] = "auto send"

    on: bool


@dataclass(frozen=True)
class WishControl:
    """Want the control of the robot, ask its holder for it, hand it over, or watch.

    Args:
        wish: Which of them.
    """

    label: ClassVar[str] = "control"

    wish: Wish


@dataclass(frozen=True)
class SendModel:
    """Send the learned model of the chosen task to the robot."""

    label: ClassVar[str] = "send model"


@dataclass(frozen=True)
class SendLibrary:
    """Send the robot of each task what it lacks."""

    label: ClassVar[str] = "send library"


@dataclass(frozen=True)
class Hand:
    """The operator's hand moved: it draws, or leads the operator's arm; while coupled it drives the robot.

    Args:
        point: Where it is, in the task's space: a position on the board [m], or a pose from the arm's base.
            Length C.
        time_s: Of the motion, not of its arrival [s].
        released: It let go.
    """

    label: ClassVar[str] = "hand"

    point: tuple[float, ...]
    time_s: float
    released: bool = False


@dataclass(frozen=True)
class ResetArm:
    """Put the operator's arm back to ready, and its receptacle elsewhere.

    Args:
        seed: Of where both are then; None: the next one.
    """

    label: ClassVar[str] = "new place"

    seed: int | None = None


@dataclass(frozen=True)
class Align:
    """Turn the plug of the operator's arm, where it is, until it points along the bore."""

    label: ClassVar[str] = "align"


@dataclass(frozen=True)
class MoveTarget:
    """Move the robot's simulated target.

    Args:
        position_m: Where its mean is to be. Length D [m].
    """

    label: ClassVar[str] = "move target"

    position_m: tuple[float, ...]


Send = SendModel | SendLibrary | AutoSend
Teach = (
    RecordDemonstration
    | EndDemonstration
    | Undo
    | LoadSamples
    | Recover
    | SelectRevision
    | StartAnew
    | Delete
    | ResetArm
    | Align
)
Intent = CommandRobot | WishControl | Hand | MoveTarget | Choose | Send | Teach
