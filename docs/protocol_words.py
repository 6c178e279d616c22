"""Texts of docs/protocol.md that the code does not contain: how it works, shared fields, errors."""

from __future__ import annotations

HEAD = """
# Protocol

Made from `common/wire/keys.py` and `common/wire/messages.py` by `python -m docs.protocol_page`; a test holds it to them.

The sites speak Zenoh over one TCP connection: the remote site listens, the local site connects, nothing is found by
itself. Each payload is one MessagePack map with the names below. Version **{schema}** is that of all messages together; a
site refuses another one by name, but for Stop and StopAck, whose form never changes: a stop is understood in every
version. Nothing above {max_bytes:,} B is unpacked, an unknown, missing or wrong field is an error, and so is a number that is not finite. Floats are double precision, in telemetry single; a report has at most
{telemetry} B. A *put* is not answered; a *query* is, and is asked again with the same content until it is.

## Keys
All below the vehicle's name, which is the session's namespace (`rov1/op/cmd`). *Urgency* is the order in which the
transport serves what waits: STOP, COMMAND, STREAM, TELEMETRY, EVENT, BULK. *Full queue*: `waits` for room, or only the
newest is sent. *Kept* is how many wait for a slow receiver; the oldest give way. *Share* is what a stream may take of a
link whose rate is known (`link.rate_bps`): what does not fit is skipped; commands, stops and their acknowledgements are
never held back. Models travel in parts on a narrow link, each asked for when the one before was confirmed.
"""

TAIL = """
## Age
The robot computes `age = its now - the echoed stamp` on its own clock. A command, renewal or input counts when its age is
at most the reference (the smallest age of the last ten accepted renewals) plus a time that follows their spread, and
never when it is above `max_age_s`; the limits stand in [safety.md](safety.md). Without an echo, or with one of another
boot, only Stop, LeaseRequest, ModelTransfer, ReportRequest, EventsRequest, CatalogueRequest and BlobRequest are
answered; their answers carry a stamp.

## Answers
A command is answered twice: by its CommandReply (received, or refused with a reason whose first number is what was measured), then by an
Event with its `command_id` (`completed` or `failed`). It runs at most once in a boot; what arrives again gets the same
first answer. What is refused, and what happens, is said as a [Reason](#reason): a code with its numbers and names; the
operator's site makes the sentence, and shows a code that it does not know as it came. A stop is sent every 0.2 s with one id until both acknowledgements came. A model counts when the robot has
returned the hash of what it decoded. Events carry numbers without a gap: who misses some asks for them (`op/events`), the
robot has the last 256.

## What is fetched
The robot lists what it looks like and the motions that it recorded (`op/catalogue`), each by its hash; a site asks at the
first report of a boot and after each event `recorded` of its own. A content is fetched in parts (`op/blob`), each asked for
when the one before has come, after an outage from where it was; it counts when its hash is right.

A content of `farhand.common.wire.motion_encoding` is a MessagePack map: `task`, `frame_names`, `n_dims`, `oriented`, `began` (a stamp)
and `rows`, single precision, little-endian: for each sample the time since the first one [s], the position [m] or pose, and
for each task frame, as perceived at that moment, its origin [m] and one angle [rad] or a quaternion. At most 100 samples in
a second, none more than 0.1 s after the one before, at most 120 s.

| a recording | is | when |
| --- | --- | --- |
| whole | fetched and learned by the site that asked for it | who drove ended it: `end recording`, Clutch, Execute, the hand let go |
| interrupted | kept; who drove may fetch and learn it (`Recover`) | Stop, Disarm, a guard, the lease or the link lost, 10 s without input |
| incomplete | not kept | 0.1 s without a sample, longer than 120 s, not driven at all |

The robot keeps the newest eight until its process ends; after its restart they are gone, and the site says so. A restarted
site learns none of them by itself: what is not in its library can be recovered.
"""

SHARED_FIELDS = {
    "schema": "Version of all messages together.",
    "seq": "Counts the messages of this kind of one sender; what does not count on is old or was there before.",
    "stamp": "When it was said, on the robot's clock.",
    "mode": "The mode of the robot then.",
    "phase": "What AUTONOMOUS is at; empty in every other mode.",
    "echo": "The newest stamp of the robot that the sender had seen and shown.",
    "session": "One life of a local site's process, a random name.",
    "site_name": "What the local site is called.",
    "lease_id": "The control of the robot, as its holder was told it; empty for none.",
    "coupling_id": "Which coupling; 0 for none. Each Couple makes a new one.",
    "command_id": "Random name of a command; in an event the one that it answers, empty for none.",
    "stop_id": "Random name of a stop; the same when it is sent again.",
    "plan_id": "Which preview; 0 for none.",
    "path_id": "Which rollout of this boot.",
    "task": "Name of the task.",
    "sha256": "Of the model's whole content.",
    "model_sha256": "Which model, by its content; empty for none.",
    "content": "Bytes of the model's file, all or a part.",
    "reason": "Why not; nil otherwise.",
    "accepted": "Whether it was.",
    "complete": "Whether all of the model has arrived.",
    "granted": "Whether the asker is in control after this.",
    "holder": "Who is in control; empty for nobody.",
    "n_dims": "Dimension D of positions.",
    "rotation_rad": "Orientation: a rotation vector in space; nothing where there is none.",
    "position_m": "In the plane or in space. In telemetry: of the effector.",
    "action": "What is asked for.",
    "wish": "What the site wants of the control.",
    "kind": "Kind of the event: completed, failed, stopped, control, decoupled, paused, ...; a newer robot may have others.",
    "succeeded": "False for what went wrong or was refused.",
    "events": "The oldest first, at most 64 at once.",
    "newest_seq": "Number of the newest event.",
    "after_seq": "The newest number up to which the asker has all.",
    "began": "When the execution began; nil before the first.",
    "arrived_after_s": "Time from there to the end of the motion; nil before it.",
    "overruns": "Control periods that came too late, in this boot.",
    "step_s": "Time from one point to the next.",
    "reaches_end": "Whether the rollout comes to the end of the motion.",
}

_DROPPED = "a put is dropped and logged, a query not answered"
_REFUSED = "refused in the first answer, written down"

# channel, words of the reply, cause, remedy; and the file that has the words
ERRORS = (
    ("any", "MessagePack was expected", "the bytes do not decode", _DROPPED, "common/wire/codec.py"),
    ("any", "version", "the other site speaks another version", _DROPPED, "common/wire/codec.py"),
    ("any", "a finite number", "NaN or infinity in any field", _DROPPED, "common/wire/codec.py"),
    ("any", "bytes, got", "a message is too large", _DROPPED, "common/wire/codec.py"),
    ("`op/cmd`", "is in control", "another site holds the lease", _REFUSED, "common/wire/words.py"),
    ("`op/cmd`", "you are not in control: the lease ended", "the sender's own lease is over", _REFUSED,
     "common/wire/words.py"),
    ("`op/cmd`, `op/lease`", "came too late: it is", "older than the limit, with the age; a lease is not renewed", _REFUSED,
     "common/wire/words.py"),
    ("`op/cmd`, `op/lease`", "it echoes no report of the robot", "no echo", _REFUSED,
     "common/wire/words.py"),
    ("`op/cmd`, `op/lease`", "it echoes another boot of the robot", "sent before a restart", _REFUSED,
     "common/wire/words.py"),
    ("`op/cmd`, `op/lease`", "it echoes a report that was never sent", "a stamp of the future", _REFUSED,
     "common/wire/words.py"),
    ("`op/cmd`", "is not allowed in", "the table of modes has no such row", _REFUSED,
     "common/wire/words.py"),
    ("`op/cmd`", "a stop travels on its own key", "Stop as a command", _REFUSED, "common/wire/words.py"),
    ("`op/cmd`, `op/model`", "this robot does", "a task that is none of the robot's", _REFUSED,
     "common/wire/words.py"),
    ("`op/cmd`", "is one of", "Execute or Preview of a task with a model that was sent for another", _REFUSED,
     "common/wire/words.py"),
    ("`op/cmd`", "the robot has no model", "Execute or Preview of a model that was not confirmed", _REFUSED,
     "common/wire/words.py"),
    ("`op/cmd`", "has not seen the target for", "Execute or Preview while it is unseen; for how long",
     _REFUSED, "common/wire/words.py"),
    ("`op/cmd`", "this task is previewed before it is executed", "Execute from DIRECT", _REFUSED,
     "common/wire/words.py"),
    ("`op/cmd`", "says nowhere to retract to", "Retract without `retract_m` in the task", _REFUSED,
     "common/wire/words.py"),
    ("`op/cmd`", "there is no plan", "Execute without a preview, or of an older boot", _REFUSED,
     "common/wire/words.py"),
    ("`op/cmd`", "the model is not the one that was previewed", "another model", _REFUSED,
     "common/wire/words.py"),
    ("`op/cmd`", "since the preview: preview again", "the robot or its target moved; with how far", _REFUSED,
     "common/wire/words.py"),
    ("`op/cmd`", "s old: preview again", "the preview is too old; with its age", _REFUSED,
     "common/wire/words.py"),
    ("`op/lease`", "held by", "another site is in control, and since when", "granted = false",
     "common/wire/words.py"),
    ("`op/lease`", "has taken over", "a newer process with the same site name has the lease",
     "granted = false", "common/wire/words.py"),
    ("`op/lease`", "handed over to", "the answer to GIVE", "granted = false", "common/wire/words.py"),
    ("`op/lease`", "watching", "the answer to WATCH", "granted = false", "common/wire/words.py"),
    ("`op/model`", "was announced,", "the hash is not that of the content", "refused, nothing is kept",
     "common/wire/words.py"),
    ("`op/model`", "dimensions and", "another dimension or number of frames", "refused, nothing is kept",
     "common/wire/words.py"),
    ("`op/model`", "the frames of task", "a model that was learned in frames of other names", "refused, nothing is kept",
     "common/wire/words.py"),
    ("`op/model`", "variances from", "numbers that nobody demonstrates: covariances, durations, places, slopes",
     "refused with the field, nothing is kept", "common/wire/words.py"),
    ("`op/model`", "is in control", "another site is in control of the robot", "refused, nothing is kept",
     "common/wire/words.py"),
    ("`op/model`", "no terminal component", "no component where a demonstration ended",
     "refused, nothing is kept", "common/wire/words.py"),
    ("`op/pose`", "stale_refused", "another lease or coupling, or too old", "ignored and counted in telemetry",
     "remote_site/supervision/session.py"),
    ("any query", "NOT DELIVERED", "no answer within 15 s, shown by the local site", "it may have been heard",
     "common/wire/words.py"),
)  # fmt: skip
