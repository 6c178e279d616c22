"""Words on the controls: buttons, sliders, choices, folders, views, layers, heads of tables, and captions of charts."""

from __future__ import annotations

import math
from enum import StrEnum


class Label(StrEnum):
    """Text on each of the operator's buttons: a verb."""

    STOP = "STOP"
    RECORD = "Record"
    END = "End"
    KEEP = "Keep anyway"
    UNDO = "Undo"
    LOAD_SAMPLES = "Load samples"
    SEND_MODEL = "Send model"
    ALIGN = "Align"
    CENTRE = "Centre"
    NEW_PLACE = "New place"
    SEND_LIBRARY = "Send library"
    START_ANEW = "Start anew"
    RECOVER = "Recover"
    ARM = "Arm"
    DISARM = "Disarm"
    COUPLE = "Couple"
    CLUTCH = "Clutch"
    PREVIEW = "Preview"
    EXECUTE = "Execute"
    PAUSE = "Pause"
    RESUME = "Resume"
    ABORT = "Abort"
    RESET = "Reset"
    RETRACT = "Retract"
    GO_TO_READY = "Go to ready"
    ASK = "Ask for control"
    HAND_OVER = "Hand over"
    ONLY_WATCH = "Only watch"
    TAKE_OVER = "Take over"
    KEEP_CONTROL = "Keep control"
    GO_TO = "Go to"
    DELETE = "Delete"
    DELETE_DEMONSTRATION = "Delete demonstration"
    HIDE_DEMONSTRATION = "Hide demonstration"
    SHOW_DEMONSTRATION = "Show demonstration"
    DOWNLOAD_DEMONSTRATION = "Download demonstration"
    UPLOAD_DEMONSTRATION = "Upload demonstration"
    DOWNLOAD_MODEL = "Download model"
    DOWNLOAD_EVENTS = "Download events"
    CUT = "Cut"
    CHANGE_PORTS = "Change ports"
    PLAY = "Play"
    FREEZE = "Freeze"
    BACK_TO_NOW = "Back to now"


class Folder(StrEnum):
    """Name of each folder of controls."""

    TASK = "Task"
    NEXT = "Next"
    WATCHING = "Watching"
    ANOTHER_TAB = "Another tab"
    VIEW = "View"
    LEGEND = "Legend"
    TEACH = "Teach"
    LIBRARY = "Library"
    DEMONSTRATIONS = "Demonstrations"
    ROBOT = "Robot"
    CONTROL = "Control"
    LINK = "Link (simulated)"
    TIME = "Time"
    PAST = "Past"
    PLANNED_MOTION = "Planned motion"
    HAND = "Hand"


class Field(StrEnum):
    """Name of each slider, choice and switch."""

    TASK = "Task"
    SPEED = "Speed [%]"
    AUTO_SEND = "Send automatically"
    REVISION = "Revision"
    DEMONSTRATION = "Demonstration"
    PROFILE = "Profile"
    DELAY = "One-way delay [ms]"
    JITTER = "Jitter [ms]"
    LOSS = "Loss [%]"
    CUT_FOR = "Cut for [s]"
    LOOK_BACK = "Look back [s]"
    PREVIEW_AT = "Preview at [s]"
    HAND = "Hand"
    HEIGHT = "Height of the hand [m]"


class Hint(StrEnum):
    """Explanation that appears while the mouse rests on a control."""

    SPEED = "Of the robot's own motions: executions, Retract, Go to ready. Not of your own driving."
    HEIGHT = "Over the board, which is the ground; also while the hand draws or drives."
    LOSS = "Share of the datagrams that are lost, in each direction"
    CHANGE_PORTS = "Continue from other ports, as after a satellite hand-over"
    SPAN = "Span of the timeline: 2 min, 15 min, the session"
    PLAY = "Play the preview, or freeze its ghost"
    CAMERA = "Show or hide: the robot's camera"
    LAYER = "Show or hide: {}"


class ViewName(StrEnum):
    """Name of each view of the scene."""

    BOTH = "Both"
    MINE = "Mine"
    ROBOT = "Robot"
    BEHIND = "Behind"
    BORE = "Bore"
    TOP = "Top"


class Layer(StrEnum):
    """Name of each part of the scene that can be hidden."""

    DEMONSTRATIONS = "Demonstrations"
    MODEL = "Model"
    PATH = "Path"
    TRACE = "Trace"
    RINGS = "Turn"
    CAMERA = "Camera"


OWN_ARM, OWN_BOARD, OWN_HAND, ROBOT_NAME = "YOUR ARM (simulation)", "YOUR BOARD", "YOUR HAND", "ROBOT"
"""Names beside the arms and boards in space."""


def high(name: str, height_m: tuple[float, ...]) -> str:
    """Return a name with a height over the ground; without one in the plane, where there is none [m]."""
    return f"{name}, {height_m[0]:.2f} m high" if height_m else name


NOTHING_FOLLOWS = "nothing follows your hand now: press Record to teach, or Couple to drive"
BEFORE_THE_END = "before the end of the motion"
"""Mark at the end of a preview that does not reach the end of the motion."""
NO_REVISION, NO_DEMONSTRATION, NO_PROFILE = "nothing was taught yet", "none yet", "custom"
"""Texts of a choice that has nothing to choose."""
SPANS: tuple[str, ...] = ("2 min", "15 min", "Session")
"""Names of the spans of the timeline."""

STEPS = ("Teach", "Send", "Arm", "Preview", "Execute")
STEP_NAMES = ("step-teach", "step-send", "step-arm", "step-preview", "step-execute")
WHY_LOCKED = (
    "", "first teach a demonstration", "first send the model", "first arm the robot", "first preview what it will do",
)  # fmt: skip
LOCKED = "Locked: {}."

NEXT, NOT_DONE = "next", "not done"
"""Titles of the advice."""
CELLS = {
    "mode": "mode", "control": "moved by", "age": "data age", "link": "link", "model": "model", "force": "force", "pending": "pending",
}  # fmt: skip
"""Titles of the cells of the band."""
YOURS, ROBOTS, RECORDING = "YOURS", "ROBOT", "RECORDING"
"""Titles of the cards under the canvas."""

DEMONSTRATION_HEAD = ("no.", "from", "seconds", "length", "end")
EXECUTION_HEAD = ("began", "task", "revision", "seconds", "peak", "at the end")
NO_EXECUTION = "nothing was executed yet"
AT_THE_GOAL, THIS_PAGE = "at the goal", "this page"
EVENTS, EVENTS_CAPTION = "events", "events, the newest first"

LANES = {"mode": "mode", "part": "part", "force": "force", "depth": "depth", "age": "age"}
"""Titles at the left of the timeline."""
TIMELINE, NOW, OLD, LIMIT = "Timeline, from {} until now", "now", "old", "limit"
DELAY, AGE, MISSING = "delay", "age", "missing"
"""Curves of the chart of the link."""
CAMERA, CAMERA_ALT = "camera", "Robot&#39;s camera"
NO_MODEL = "nothing was learned yet"
GRAPH_EMPTY, GRAPH_CAPTION = "learned model", "learned model: components, transitions, durations [s]"
GRAPH_END = "end"


def scene_name(name: str, seconds: float | None, past: bool) -> str:
    """Return the robot's name in the scene, with its age where it is old.

    Args:
        name: Name of the robot.
        seconds: Age of what is drawn [s]; None for the present.
        past: True while the operator looks back.
    """
    if seconds is None:
        return name
    return f"{name}, {round(seconds)} s ago, not now" if past else f"{name}, {math.floor(seconds)} s ago"
