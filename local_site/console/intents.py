"""Intents: everything that an operator can ask of the console, each a value for its one queue."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from farhand.common.mode_table import Action, ControlMode
from farhand.common.wire.messages import Wish
from farhand.local_site.workcell.hand_motion import Nudge


@dataclass(frozen=True)
class CommandRobot:
    """Request for an action of the robot.

    Args:
        action: Action.
        shown_mode: Mode that the operator saw; the command is refused if it has changed. None: not checked.
        pace: For "set pace": speed of the robot's own motions as a share of their intended speed, 0.1 to 1.
    """

    action: Action
    shown_mode: ControlMode | None = None
    pace: float = 1.0

    @property
    def label(self) -> str:
        """Name of the intent in events."""
        return str(self.action)


@dataclass(frozen=True)
class RecordDemonstration:
    """Request to begin a demonstration."""

    label: ClassVar[str] = "record"


@dataclass(frozen=True)
class EndDemonstration:
    """Request to end the demonstration in progress and keep it.

    Args:
        anyway: True to keep a motion that misses the task's goal without asking the operator.
    """

    label: ClassVar[str] = "end"
    anyway: bool = False


@dataclass(frozen=True)
class Undo:
    """Request to discard the demonstration in progress, else the last one."""

    label: ClassVar[str] = "undo"


@dataclass(frozen=True)
class LoadSamples:
    """Request to learn the demonstrations that come with the task."""

    label: ClassVar[str] = "load samples"


@dataclass(frozen=True)
class LearnFile:
    """Request to learn the demonstration in a file.

    Args:
        name: Name of the file.
        content: Its bytes; empty for a file that is too large to be taken.
    """

    label: ClassVar[str] = "upload"
    name: str
    content: bytes


@dataclass(frozen=True)
class Recover:
    """Request to learn the demonstration that an earlier process was recording when it ended."""

    label: ClassVar[str] = "recover"


@dataclass(frozen=True)
class SelectRevision:
    """Request to make another revision of the task current.

    Args:
        revision: Number of the revision.
    """

    label: ClassVar[str] = "go to"
    revision: int


@dataclass(frozen=True)
class StartAnew:
    """Request to begin the task without demonstrations; the present ones stay available as a revision."""

    label: ClassVar[str] = "start anew"


@dataclass(frozen=True)
class Delete:
    """Request to delete a revision that is not current.

    Args:
        revision: Number of the revision.
    """

    label: ClassVar[str] = "delete"
    revision: int


@dataclass(frozen=True)
class RemoveDemonstration:
    """Request to remove one of the current demonstrations.

    Args:
        name: Name of its file: a number would mean another one after a removal.
    """

    label: ClassVar[str] = "delete demonstration"
    name: str


@dataclass(frozen=True)
class Choose:
    """Request to choose another task for teaching, previews and executions.

    Args:
        task: Name of the task.
    """

    label: ClassVar[str] = "choose"
    task: str


@dataclass(frozen=True)
class AutoSend:
    """Choice whether the model is sent whenever it changes, or only on request.

    Args:
        on: True to send it whenever it changes.
    """

    label: ClassVar[str] = "auto send"
    on: bool


@dataclass(frozen=True)
class WatchCamera:
    """Choice whether the robot's pictures are requested.

    Args:
        on: True to request them.
    """

    label: ClassVar[str] = "camera"
    on: bool


@dataclass(frozen=True)
class WishControl:
    """Wish to take the control of the robot, ask its holder for it, hand it over, or watch.

    Args:
        wish: Kind of wish.
    """

    label: ClassVar[str] = "control"
    wish: Wish


@dataclass(frozen=True)
class SendModel:
    """Request to send the learned model of the chosen task to the robot."""

    label: ClassVar[str] = "send model"


@dataclass(frozen=True)
class SendLibrary:
    """Request to send the robot every task's model that it lacks."""

    label: ClassVar[str] = "send library"


@dataclass(frozen=True)
class Hand:
    """Movement of the operator's hand: it draws, or leads the operator's arm.

    While coupled it drives the robot.

    Args:
        point: Point of the hand in the task's space: a position on the board [m], or a pose relative to the
            arm's base. Length C.
        time_s: Time of the motion, not of its arrival [s].
        released: True when the hand let go.
    """

    label: ClassVar[str] = "hand"
    point: tuple[float, ...]
    time_s: float
    released: bool = False


@dataclass(frozen=True)
class ResetArm:
    """Request to put the operator's arm back to ready, and its receptacle, or the frames of a board, elsewhere.

    Args:
        seed: Seed of the new placement; None: the next one.
    """

    label: ClassVar[str] = "new place"
    seed: int | None = None


@dataclass(frozen=True)
class Align:
    """Request to turn the plug of the operator's arm, where it is, until it points along the bore."""

    label: ClassVar[str] = "align"


@dataclass(frozen=True)
class Centre:
    """Request to move the plug of the operator's arm onto the bore's axis, at its distance from the mouth."""

    label: ClassVar[str] = "centre"


@dataclass(frozen=True)
class StepArm:
    """Request for a step of the operator's arm.

    Args:
        nudge: Displacement and turn.
    """

    label: ClassVar[str] = "step"

    nudge: Nudge


@dataclass(frozen=True)
class DragTarget:
    """Request to move the robot's simulated target.

    Args:
        position_m: New mean position of the target. Length D [m].
    """

    label: ClassVar[str] = "move target"
    position_m: tuple[float, ...]


Send = SendModel | SendLibrary | AutoSend
MoveHand = Align | Centre | StepArm
Teach = (
    RecordDemonstration
    | EndDemonstration
    | Undo
    | LoadSamples
    | LearnFile
    | Recover
    | SelectRevision
    | StartAnew
    | Delete
    | RemoveDemonstration
    | ResetArm
    | MoveHand
)
Intent = CommandRobot | WishControl | WatchCamera | Hand | DragTarget | Choose | Send | Teach
