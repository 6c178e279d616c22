"""The one rule for what may be done to a task's demonstrations now.

The page's buttons, the console and the script ask it with the console's state, the library with its own.
"""

from __future__ import annotations

from enum import StrEnum
from typing import Protocol

from farhand.common.errors import FarhandError
from farhand.common.wire.reason_words import sentence
from farhand.common.wire.reasons import Code, Reason, because, in_words
from farhand.local_site.teaching.revisions import Revision


class NotNow(FarhandError):
    """Refusal of something that is not possible at this moment.

    Args:
        why: Reason, or words where it has no code of its own.
    """

    def __init__(self, why: Reason | str):
        self.reason = in_words(why) if isinstance(why, str) else why
        super().__init__(why if isinstance(why, str) else sentence(why))


class Act(StrEnum):
    """Actions on the demonstrations of a task."""

    RECORD = "record"
    END = "end"
    UNDO = "undo"
    LEARN = "learn"
    RECOVER = "recover"
    GO_TO = "go to"
    START_ANEW = "start anew"
    DELETE = "delete"
    REMOVE = "remove"


class TaughtState(Protocol):
    """State on which the permission depends."""

    @property
    def recording(self) -> bool:
        """True while a demonstration is recorded."""
        ...

    @property
    def can_undo(self) -> bool:
        """True if a demonstration can be undone."""
        ...

    @property
    def can_recover(self) -> bool:
        """True if an unfinished demonstration was not learned yet."""
        ...

    @property
    def demonstration_names(self) -> tuple[str, ...]:
        """Names of the current demonstrations, in their order."""
        ...

    @property
    def revision(self) -> int:
        """Number of the current revision, 0 before the first."""
        ...

    @property
    def revisions(self) -> tuple[Revision, ...]:
        """Newest revisions."""
        ...


def teaching_refusal(act: Act, taught: TaughtState, number: int = 0, name: str = "") -> Reason | None:
    """Return why an action is not possible now; None if it is.

    Args:
        act: Action.
        taught: State of the task's demonstrations.
        number: Number of the revision that the action names, if it names one.
        name: Name of the demonstration that the action names, if it names one.
    """
    if act is Act.END:
        return None if taught.recording else because(Code.NOT_RECORDING)
    if act is Act.UNDO:
        return None if taught.can_undo else because(Code.NOTHING_TO_UNDO)
    if taught.recording:
        return because(Code.RECORDING_HERE)
    if act is Act.RECOVER:
        return None if taught.can_recover else because(Code.NOTHING_TO_RECOVER)
    if act is Act.START_ANEW:
        return None if taught.can_undo else because(Code.NOTHING_TAUGHT)
    if act is Act.REMOVE:
        return None if name in taught.demonstration_names else because(Code.NO_SUCH_DEMONSTRATION)
    return _revision_refusal(number, taught) if act in (Act.GO_TO, Act.DELETE) else None


def _revision_refusal(number: int, taught: TaughtState) -> Reason | None:
    if number not in {each.number for each in taught.revisions}:
        return because(Code.NO_SUCH_REVISION, number=number)
    return because(Code.CURRENT_REVISION, number=number) if number == taught.revision else None
