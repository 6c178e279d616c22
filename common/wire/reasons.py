"""Reasons on the wire: an enumerated code with its numbers and names. `reason_words.py` makes sentences of them.

A site that does not know a code, because the other one is newer, still decodes it and shows the code with its
values.
"""

from __future__ import annotations

import math
from enum import StrEnum
from typing import Annotated

from msgspec import Meta, Struct

from farhand.common.errors import on_one_line
from farhand.common.names import PRINTABLE

MOST_TEXT = 240
_MOST_NUMBER = 1e30
N_MORE = "n_more"
"""Value of any reason: number of similar events that were only counted."""


class Code(StrEnum):
    """Reasons of refusals, failures and events. `words.WORDS` names the values that belong to each."""

    OTHER = "other"
    """Free text of a robot of your own, or of an error: one value, `text`."""

    # The session: control, and age of messages
    NO_ECHO = "no echo"
    OTHER_BOOT = "other boot"
    NEVER_SENT = "never sent"
    TOO_OLD = "too old"
    ANONYMOUS = "anonymous"
    TAKEN_OVER = "taken over"
    ONLY_WATCHES = "only watches"
    WATCHING = "watching"
    HANDED_OVER = "handed over"
    WAITING_TO_HEAR = "waiting to hear"
    HELD = "held"
    LEASE_ENDED = "lease ended"
    LEASE_CHANGED = "lease changed"
    OTHER_IN_CONTROL = "other in control"
    NOTHING_IN_TIME = "nothing in time"
    CONTROL_TAKEN = "control taken"
    CONTROL_LOST = "control lost"
    UNLISTED = "unlisted"
    REVOKED = "revoked"
    OBSERVER = "observer"
    OTHER_ROBOT = "other-robot"
    OTHER_NAME = "other name"

    # Commands
    NOT_ANSWERED = "not answered"
    NOT_REPORTED = "not reported"
    OTHER_VERSION = "other version"
    PAGE_BEHIND = "page behind"
    UNDER_WAY = "under way"
    OWN_STOP = "own stop"
    RECORDING_HERE = "recording here"
    OWN_KEY = "own key"
    WRONG_MODE = "wrong mode"
    NO_RETRACT = "no retract"
    OTHER_TASK = "other task"
    NO_MODEL = "no model"
    NO_SUCH_MODEL = "no such model"
    MODEL_DIFFERS = "model differs"
    MODEL_OF_OTHER_TASK = "model of other task"
    NOT_SEEN = "not seen"
    NOT_SEEN_YET = "not seen yet"
    CANNOT_START = "cannot start"
    CLUTCH_FIRST = "clutch first"
    NOT_PREVIEWED = "not previewed"
    NO_SUCH_PLAN = "no such plan"
    OTHER_MODEL_PREVIEWED = "other model previewed"
    MOVED_SINCE = "moved since"
    TURNED_SINCE = "turned since"
    PREVIEW_TOO_OLD = "preview too old"
    IN_RECEPTACLE = "in receptacle"
    WAY_OUT_UNKNOWN = "way out unknown"
    OUT_OF_REACH = "out of reach"
    JOINTS_END = "joints end"
    EITHER_WAY = "either way"
    WRIST_STRAIGHT = "wrist straight"
    WRIST_NEARLY_STRAIGHT = "wrist nearly straight"
    NOT_DELIVERED = "not delivered"
    NEVER_ENDED = "never ended"

    # Requests to the operator's own site
    NOTHING_TO_UNDO = "nothing to undo"
    NOTHING_TO_RECOVER = "nothing to recover"
    NOTHING_TAUGHT = "nothing taught"
    NO_SUCH_REVISION = "no such revision"
    CURRENT_REVISION = "current revision"
    NO_SUCH_DEMONSTRATION = "no such demonstration"
    NO_SUCH_TASK = "no such task"
    ROBOT_EXECUTES = "robot executes"
    NO_OWN_ARM = "no own arm"
    NO_OTHER_PLACE = "no other place"
    HAND_DRIVES = "hand drives"
    NOT_BEFORE_MOUTH = "not before mouth"
    HAS_IT = "has it"
    IN_CONTROL = "in control"
    NOBODY_ASKS = "nobody asks"

    # Models
    HASH_DIFFERS = "hash differs"
    MODEL_MALFORMED = "model malformed"
    POSES_WANTED = "poses wanted"
    POSITIONS_WANTED = "positions wanted"
    OTHER_SIZE = "other size"
    OTHER_FRAMES = "other frames"
    NO_END = "no end"
    TOO_LARGE = "too large"
    VARIANCE = "variance"
    CONDITION = "condition"
    NOT_A_MOTION = "not a motion"

    # The camera
    NO_CAMERA = "no camera"
    CAMERA_STARTS = "camera starts"
    CAMERA_FAILED = "camera failed"
    LINK_NARROW = "link narrow"

    # Ends of commands, and other events
    DONE = "done"
    RESUMED = "resumed"
    COUPLED = "coupled"
    PACE = "pace"
    EXECUTING = "executing"
    AT_END = "at end"
    MANOEUVRE_ENDED = "manoeuvre ended"
    MANOEUVRE_GAVE_UP = "manoeuvre gave up"
    HOLDS_AFTER = "holds after"
    PREVIEWED = "previewed"
    PREVIEWED_WITH_WARNING = "previewed with warning"
    REPLACED = "replaced"
    OVERTAKEN = "overtaken"
    ENDED_BY = "ended by"
    STOPPED_BY = "stopped by"
    PLAN_FAILED = "plan failed"
    INTERRUPTED = "interrupted"
    SUSPENDED = "suspended"
    PLACE_NOT_KEPT = "place not kept"
    PLACE_NOT_UNDERSTOOD = "place not understood"
    LISTENER_DROPPED = "listener dropped"

    # Recordings by the robot
    RECORDING_ALREADY = "recording already"
    NOT_RECORDING = "not recording"
    RECORDED = "recorded"
    RECORDING_INTERRUPTED = "recording interrupted"
    RECORDING_INCOMPLETE = "recording incomplete"
    NOTHING_RECORDED = "nothing recorded"
    SAMPLE_MISSING = "sample missing"
    RECORDING_TOO_LONG = "recording too long"

    # Guards
    DRAG_ENDED = "drag ended"
    NO_INPUT = "no input"
    LEASE_LOST = "lease lost"
    DELAY_CHANGED = "delay changed"
    SILENCE = "silence"
    FORCE = "force"
    JAMMED = "jammed"
    TARGET_LOST = "target lost"
    TARGET_MOVED = "target moved"
    TARGET_TURNED = "target turned"
    LINK_LOST = "link lost"
    BLIND_AND_ALONE = "blind and alone"
    LOOP_LATE = "loop late"
    LOOP_FAILED = "loop failed"
    NOT_FINITE_MEASURED = "not finite measured"
    NOT_FINITE_COMPUTED = "not finite computed"
    MEASUREMENT_WRONG = "measurement wrong"
    CANNOT_MOVE = "cannot move"
    MACHINE_FAULT = "machine fault"
    STANDS_STILL = "stands still"


class Value(Struct, frozen=True, forbid_unknown_fields=True, array_like=True):
    """Value of a reason."""

    name: Annotated[str, Meta(pattern=PRINTABLE, max_length=32)]
    """Name, which ends with the unit, as in `age_s`; a list repeats one name."""
    value: (
        Annotated[float, Meta(ge=-_MOST_NUMBER, le=_MOST_NUMBER)] | Annotated[str, Meta(max_length=MOST_TEXT)]
    )


class Reason(Struct, frozen=True, forbid_unknown_fields=True, array_like=True):
    """Reason of a refusal or an event, or an outcome."""

    code: Annotated[str, Meta(pattern=PRINTABLE, max_length=32)]
    """Code, one of the known ones or a newer one."""
    values: Annotated[tuple[Value, ...], Meta(max_length=16)] = ()

    @property
    def measured(self) -> float | None:
        """First of its numbers, which is the measured value; None without one."""
        numbers = (each.value for each in self.values if each.name != N_MORE)
        return next((number for number in numbers if not isinstance(number, str)), None)

    def with_value(self, name: str, value: float | str) -> Reason:
        """Return the same reason with one more value."""
        return Reason(self.code, (*self.values, _value(name, value)))


def because(code: Code, **values: float | str | tuple[str, ...]) -> Reason:
    """Return a reason; its texts, which may be a driver's or of a name from outside, become one line.

    Args:
        code: Code of the reason.
        values: Numbers and names of the reason, in the order on the wire, the measured value first.
    """
    return Reason(
        code.value,
        tuple(
            _value(name, each)
            for name, given in values.items()
            for each in (given if isinstance(given, tuple) else (given,))
        ),
    )


def in_words(text: object) -> Reason:
    """Return a reason without a code of its own, such as the text of an error or of a robot of your own."""
    return because(Code.OTHER, text=str(text))


def _value(name: str, value: float | str) -> Value:
    if isinstance(value, str):
        return Value(name, on_one_line(value)[:MOST_TEXT])
    number = float(value)
    return Value(name, 0.0 if math.isnan(number) else min(max(number, -_MOST_NUMBER), _MOST_NUMBER))
