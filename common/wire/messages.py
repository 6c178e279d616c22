"""Every message on the wire. `keys.py` has the key of each, `codec.py` its bytes.

Times are seconds or nanoseconds of the sender's own monotonic clock. A stamp of the robot that comes back as
an `echo` lets the robot compute an age on its own clock alone.
"""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

from msgspec import UNSET, Meta, Struct, UnsetType

from farhand.common.mode_table import Action, ControlMode, Phase
from farhand.common.names import MOST_SITE_NAME, PRINTABLE, SiteName
from farhand.common.wire.reasons import Reason

SCHEMA = 2
"""Version of all messages together; a site refuses another one by name."""
MAX_TELEMETRY_BYTES, FRAME_BYTES = 272, 34
"""Largest size of a report of one task frame, and of each further frame in it [B]."""
MOST_FRAMES = 4
"""Largest number of task frames of a task."""
MAX_MODEL_BYTES = 2_000_000
"""Largest size of a model [B]: twice that of the most components with every transition and four frames."""

MOST_CONTENT_BYTES = 65_536
"""Largest size of a part of bulk content [B]."""
MAX_BYTES = 4 * MOST_CONTENT_BYTES
"""Largest size of a message [B]; the robot sends as many events at a time as fit.

The transport accepts little more, the decoder no more.
"""
MAX_PICTURE_BYTES = 16_384
"""Largest size of a picture [B]; one of usual quality has a fifth of it."""
MOST_TASKS = 8
"""Largest number of tasks of a robot."""

Id = Annotated[str, Meta(pattern=PRINTABLE, max_length=64)]
Count = Annotated[int, Meta(ge=0)]
Coordinate = Annotated[float, Meta(ge=-1e6, le=1e6)]
"""Coordinate, bounded so that sums and differences of received values stay finite [m]."""
Vector = Annotated[tuple[Coordinate, ...], Meta(min_length=2, max_length=3)]
Rotation = Annotated[tuple[Annotated[float, Meta(ge=-10.0, le=10.0)], ...], Meta(max_length=3)]
"""Rotation: empty for none, one angle in the plane, a rotation vector in space [rad]."""
Sha256 = Annotated[str, Meta(pattern=r"^([0-9a-f]{64})?\Z")]
SLOWEST_PACE = 0.1
Pace = Annotated[float, Meta(ge=SLOWEST_PACE, le=1.0)]
"""Speed of an execution as a share of its demonstrated speed."""


class Message(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Base of all messages."""

    schema: int = SCHEMA


class Stamp(Struct, frozen=True, forbid_unknown_fields=True, array_like=True):
    """Instant of one boot of the robot: boot id and monotonic time [ns]."""

    boot: Id
    t_ns: Count


class ArmState(Struct, frozen=True, forbid_unknown_fields=True, array_like=True):
    """Report of an arm beyond that of a point."""

    rotation_rad: tuple[float, float, float]
    """Orientation of its tool: a rotation vector [rad]."""
    joints_rad: Annotated[tuple[float, ...], Meta(max_length=8)]
    """Joint angles [rad]."""
    force_n: float
    """Force on its tool [N]."""
    overruns: Count
    """Control periods of this boot that were skipped because they came too late."""


class Telemetry(
    Message,
    frozen=True,
    kw_only=True,
    omit_defaults=True,
    rename={
        "stamp": "t", "position_m": "p", "frame_origin_m": "o", "frame_rotation_rad": "r", "mode": "m",
        "phase": "f", "component": "c", "elapsed_s": "e", "path_id": "i", "model": "g",
        "coupling_id": "k", "holder": "h", "lease": "l", "heartbeat_echo": "b", "heartbeat_held_ms": "d",
        "waiting": "w", "other_frames": "n", "stale_refused": "x", "pace": "q", "seq": "s", "schema": "v",
        "arm": "a", "recorded_s": "u",
    },
):  # fmt: skip
    """Robot's report of itself, newest only.

    With one task frame a point's has at most 200 B, an arm's of 8 joints 272 B: short names, single precision, and only
    what differs from its default.
    """

    schema: int = SCHEMA  # repeated, so that its short name applies
    seq: Count
    stamp: Stamp
    mode: ControlMode
    phase: Phase = Phase.NONE
    position_m: Vector
    frame_origin_m: Vector
    """Origin of the goal's task frame, the last one, as perceived [m]."""
    frame_rotation_rad: Rotation = ()
    """Rotation of the goal's task frame: one angle in the plane, a rotation vector in space [rad]."""
    other_frames: (
        Annotated[tuple[Coordinate, ...], Meta(min_length=3, max_length=6 * (MOST_FRAMES - 1))] | UnsetType
    ) = UNSET
    """Task frames before the goal's, one after the other, each with its origin and rotation; unset for none."""
    component: int = -1
    """Component in execution; -1 without an execution, and on a way."""
    elapsed_s: float = 0.0
    """Time since the execution began [s]."""
    path_id: Count = 0
    """Committed path in execution."""
    model: Annotated[str, Meta(max_length=8)] = ""
    """First digits of the newest verified model's hash."""
    coupling_id: Count = 0
    holder: Annotated[str, Meta(max_length=MOST_SITE_NAME)] = ""
    """Holder of the lease, cut to 16 bytes."""
    lease: Annotated[str, Meta(max_length=4)] = ""
    """First digits of the lease, so that its holder knows whether it is still valid."""
    heartbeat_echo: Count = 0
    """Sequence number of the newest heartbeat of the lease's holder."""
    heartbeat_held_ms: float = 0.0
    """Time from its arrival to the sending of this report [ms]."""
    waiting: bool = False
    """DIRECT without input for half a second: the robot waits where it is."""
    stale_refused: Count = 0
    """Number of operators' messages refused for their age or their lease in this boot."""
    pace: float = 1.0
    """Speed of executions and manoeuvres, as a share of their intended speed."""
    arm: ArmState | UnsetType = UNSET
    """State of an arm; unset for a point."""
    recorded_s: float | UnsetType = UNSET
    """Duration so far of the motion that is recorded in DIRECT."""


class Heartbeat(Message, frozen=True, kw_only=True):
    """Sign of life of the operator's site, with the newest report that it has shown."""

    session: Id
    seq: Count
    echo: Stamp | None


class OperatorInput(Message, frozen=True, kw_only=True):
    """Pose of the operator's hand. Accepted only with the present coupling and lease."""

    seq: Count
    echo: Stamp
    lease_id: Id
    coupling_id: Count
    position_m: Vector
    rotation_rad: Rotation = ()
    """Orientation of a hand that guides a pose: a rotation vector [rad]."""
    released: bool = False
    """The drag ended: the operator let go."""


class MoveTarget(Message, frozen=True, kw_only=True):
    """Request of the lease's holder to move the mean of a simulated target.

    A real robot does not serve it.
    """

    echo: Stamp
    lease_id: Id
    position_m: Vector


class Wish(StrEnum):
    """Local site's request about the control of the robot."""

    CONTROL = "control"
    """Take the control when it is free, and keep it."""
    WATCH = "watch"
    """Only watch; give up the control."""
    ASK = "ask"
    """Ask the holder for the control."""
    GIVE = "give"
    """Hand the control over to the site that asked."""


class LeaseRequest(Message, frozen=True, kw_only=True):
    """Request for the control of the robot, its renewal or its hand-over. Moves nothing."""

    session: Id
    site_name: SiteName
    wish: Wish = Wish.CONTROL
    echo: Stamp | None = None


class LeaseReply(Message, frozen=True, kw_only=True):
    """Answer to a lease request, with the robot's kind."""

    granted: bool
    lease_id: Id
    """The asker's lease, empty for none: a late renewal does not end it, silence does."""
    holder: Id
    reason: Reason | None = None
    asked_by: Id = ""
    """To the holder: name of the site that asks for the control."""
    stamp: Stamp
    tasks: Annotated[tuple[Id, ...], Meta(min_length=1, max_length=MOST_TASKS)]
    """Names of the robot's tasks; the robot starts with the first."""
    n_dims: Annotated[int, Meta(ge=2, le=3)]
    newest_age_s: float | None = None
    """Age of the echo in the request, as the robot measured it [s]."""


class Command(Message, frozen=True, kw_only=True):
    """Action asked of the robot; runs at most once in a boot, however often it arrives."""

    command_id: Id
    session: Id
    lease_id: Id
    action: Action
    echo: Stamp | None
    task: Id = ""
    model_sha256: Sha256 = ""
    plan_id: Count = 0
    pace: Pace = 1.0
    """New speed for "set pace", for all executions and manoeuvres from then on."""


class CommandReply(Message, frozen=True, kw_only=True):
    """First answer to a command: accepted, or refused with the reason and the measured value."""

    command_id: Id
    accepted: bool
    reason: Reason | None = None
    mode: ControlMode
    stamp: Stamp

    @property
    def measured(self) -> float | None:
        """Measured value; None without one."""
        return self.reason.measured if self.reason is not None else None


class EventKind(StrEnum):
    """Kinds of events; a newer robot may have others."""

    COMPLETED = "completed"
    """A command succeeded."""
    FAILED = "failed"
    """A command was begun and failed."""
    EXECUTING = "executing"
    CONTROL = "control"
    """The control of the robot changed hands."""
    RECORDED = "recorded"
    """A recording in DIRECT ended, good or bad."""
    STOPPED = "stopped"
    DECOUPLED = "decoupled"
    BACKING_OFF = "backing off"
    GAVE_UP = "gave up"
    PAUSED = "paused"
    RETRACTING = "retracting"
    HOLDING = "holding"
    """A manoeuvre that the robot began on its own has ended."""
    INTERRUPTED = "interrupted"
    """The robot's process ended during an execution."""
    RESTARTED = "restarted"
    DROPPED = "dropped"
    """A listener that read nothing was dropped."""


class Event(Message, frozen=True, kw_only=True):
    """Event at the robot; for a command its second answer: completed or failed."""

    seq: Count
    stamp: Stamp
    kind: Id
    """One of the kinds of events, or a newer one."""
    reason: Reason
    """Outcome, or cause."""
    cause: Reason | None = None
    """Reason behind the reason, if there is one."""
    command_id: Id = ""
    action: Id = ""
    """Action of the command."""
    succeeded: bool = True
    mode: ControlMode
    coupling_id: Count = 0
    plan_id: Count = 0
    who: Id = ""
    """Site that caused it, empty for the robot itself."""

    @property
    def measured(self) -> float | None:
        """Measured value; None without one."""
        return self.reason.measured


class EventsRequest(Message, frozen=True, kw_only=True):
    """Request for the events after a number, which an outage has swallowed."""

    after_seq: Count = 0


class EventsReply(Message, frozen=True, kw_only=True):
    """Robot's events of this boot, oldest first; only the newest are kept."""

    events: Annotated[tuple[Event, ...], Meta(max_length=64)]
    newest_seq: Count
    stamp: Stamp


class ModelTransfer(Message, frozen=True, kw_only=True):
    """Learned model, whole or in parts; a part without content asks whether the robot has the model."""

    session: Id = ""
    """Session of the sender: while a site is in control of the robot, only that site may send models."""
    task: Id
    sha256: Sha256
    version: Count = 0
    """Counts the models of one local site."""
    parent_sha256: Sha256 = ""
    """SHA-256 of the model that this one was refined from."""
    size: Annotated[int, Meta(ge=0, le=MAX_MODEL_BYTES)] = 0
    """Size of the whole model [B]; 0: this message has all of it."""
    offset: Count = 0
    """Offset of this part in the model [B]."""
    content: Annotated[bytes, Meta(max_length=MOST_CONTENT_BYTES)]


class ModelReply(Message, frozen=True, kw_only=True):
    """Robot's confirmation of a model, by the hash of what it stored.

    After a part it names the number of arrived bytes; the model is confirmed when all have arrived.
    """

    accepted: bool
    sha256: Sha256
    complete: bool = True
    received: Count = 0
    """Bytes that have arrived from the beginning; the next part begins there."""
    reason: Reason | None = None
    stamp: Stamp


class CatalogueRequest(Message, frozen=True, kw_only=True):
    """Request for the list of the robot's recordings and its drawing."""


class RecordingOffer(Struct, frozen=True, forbid_unknown_fields=True, array_like=True):
    """Motion that the robot recorded while it was driven."""

    sha256: Sha256
    """SHA-256 of its content, see `farhand.common.wire.motion_encoding`."""
    site_name: Id
    """Site that drove."""
    whole: bool
    """True if the driving operator ended it, False if anything else did."""
    duration_s: float


class CatalogueReply(Message, frozen=True, kw_only=True):
    """Contents that the robot offers, each by its hash."""

    scene_sha256: Sha256 = ""
    """SHA-256 of the robot's drawing, see `farhand.common.wire.scene_description`; empty for a point."""
    sketch_sha256: Sha256 = ""
    """SHA-256 of a coarse drawing, for the first look over a slow link; empty for a point."""
    recordings: Annotated[tuple[RecordingOffer, ...], Meta(max_length=8)] = ()
    """Recordings of this boot, the newest last."""
    version: Id = ""
    """Version of the robot's Farhand."""
    stamp: Stamp


class BlobRequest(Message, frozen=True, kw_only=True):
    """Request for a part of a content that the catalogue names."""

    sha256: Sha256
    """SHA-256 of the whole content."""
    offset: Count = 0
    """Offset of the part in what travels [B]."""
    n_bytes: Annotated[int, Meta(ge=1, le=MOST_CONTENT_BYTES)]
    """Largest size of the part [B]."""


class BlobReply(Message, frozen=True, kw_only=True):
    """Part of a content as it travels, plain or packed by zlib; the receiver of all parts unpacks what has another hash."""

    sha256: Sha256
    """SHA-256 of the whole content."""
    size: Annotated[int, Meta(ge=0, le=4_000_000)]
    """Size of all that travels [B]; 0: the robot does not have it."""
    offset: Count = 0
    """Offset of the part in what travels [B]."""
    content: Annotated[bytes, Meta(max_length=MOST_CONTENT_BYTES)] = b""
    """Bytes of the part."""
    stamp: Stamp


class PlannedPath(Message, frozen=True, kw_only=True):
    """Rollout of the whole remaining task, in task-frame coordinates."""

    path_id: Count
    plan_id: Count = 0
    """Id of the plan if an operator asked for it by Preview."""
    stamp: Stamp
    """Beginning of the rollout: the time of its first point."""
    model_sha256: Sha256
    n_coordinates: Annotated[int, Meta(ge=2, le=7)]
    """Coordinates per point: two or three of a position [m], seven of a pose."""
    step_s: Annotated[float, Meta(gt=0, le=10)]
    points: Annotated[bytes, Meta(max_length=200 * 7 * 2)]
    """Shape (N, n_coordinates); see `farhand.common.wire.motion_encoding`."""
    reaches_end: bool
    away: Annotated[float, Meta(ge=0, le=1e6)] = 0.0
    """Distance of a previewed motion's start or end from the demonstrated ones, as a multiple of their spread; 0: no preview."""
    away_frame: Count = 0
    """Index of the task frame in which that multiple is largest, from 0."""


class CameraRequest(Message, frozen=True, kw_only=True):
    """Request for pictures of the robot's camera, repeated while somebody looks at them."""

    session: Id
    late_s: Annotated[float, Meta(ge=0, le=1e6)] = 0.0
    """Largest excess of a picture's transit over that of the quickest report, since the last request [s]."""


class CameraReply(Message, frozen=True, kw_only=True):
    """Robot's answer whether it sends pictures."""

    sends: bool
    """True if pictures come, or will as soon as the camera gives one."""
    reason: Reason | None = None
    """Reason why no picture comes now; nil while they come."""
    stamp: Stamp


class PictureView(Struct, frozen=True, forbid_unknown_fields=True, array_like=True):
    """Pinhole camera that took a picture, its axes to the right, down and forwards."""

    pose: tuple[Coordinate, Coordinate, Coordinate, Coordinate, Coordinate, Coordinate, Coordinate]
    """Pose of the camera from the arm's base: position [m] and quaternion w, x, y, z."""
    focal_px: Annotated[float, Meta(gt=0, le=1e6)]
    """Focal length in pixels of the picture."""
    centre_px: tuple[Coordinate, Coordinate]
    """Place of the optical axis, from the upper left corner of the picture."""


class CameraPicture(Message, frozen=True, kw_only=True):
    """Picture of the robot's camera, newest only."""

    seq: Count
    stamp: Stamp
    """Time of the exposure."""
    taken_s: Annotated[float, Meta(ge=0, le=1e6)] = 0.0
    """Time from the exposure to the sending, which the camera took and not the link [s]."""
    width_px: Annotated[int, Meta(ge=1, le=4096)]
    """Width of the picture."""
    height_px: Annotated[int, Meta(ge=1, le=4096)]
    """Height of the picture."""
    jpeg: Annotated[bytes, Meta(max_length=MAX_PICTURE_BYTES)]
    """JPEG file."""
    view: PictureView | None = None
    """Camera that took it; nil if the camera does not know its own place."""


class Stop(Message, frozen=True, kw_only=True):
    """Stop of the robot: anybody may send it, whatever their lease.

    Resent until both acknowledgements came.
    """

    stop_id: Id
    site_name: SiteName


class StopAck(Message, frozen=True, kw_only=True):
    """Acknowledgement of a stop; each stop gets two."""

    stop_id: Id
    standing: bool
    """False: received, braking. True: the robot stands still."""
    stamp: Stamp


ANY_VERSION: tuple[type[Message], ...] = (Stop, StopAck)
"""Messages whose form never changes: a site of any version stops the robot, and hears that it stands."""


class ReportRequest(Message, frozen=True, kw_only=True):
    """Request for the record of the newest execution."""


class ExecutionReport(Message, frozen=True, kw_only=True):
    """Outcome of the newest execution, measured at the robot."""

    began: Stamp | None = None
    task: Id = ""
    model_sha256: Sha256 = ""
    arrived_after_s: float | None = None
    tracked_s: float = 0.0
    """Time since the arrival that was recorded, and that the errors below cover where they are known [s]."""
    rms_error_m: float | None = None
    """Distance of the effector to the target's true centre (a simulation knows it), RMS [m]."""
    end_error_m: float | None = None
    """The same distance as last measured [m]."""
    depth_m: float | None = None
    """Depth of a plug behind the mouth of the receptacle [m]."""
    lateral_m: float | None = None
    """Distance of a plug from the axis of the receptacle [m]."""
    peak_force_n: float | None = None
    """Largest force on the tool so far [N]."""
    holding_force_n: float | None = None
    """Mean force on the tool since the arrival [N]."""
    succeeded: bool | None = None
    """True if the task succeeded by its own rule; None if the robot cannot know."""
    overruns: Count = 0
    stamp: Stamp
