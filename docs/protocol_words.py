"""Texts of docs/protocol.md that the code does not contain: how it works, shared fields, errors."""

from __future__ import annotations

HEAD = """
# Protocol

Made from `common/wire/keys.py` and `common/wire/messages.py` by `python -m docs.protocol_page`; a test holds it to them.

The sites speak Zenoh over QUIC, TLS or TCP: the remote site listens, the local site connects, and there is no
discovery. Each payload is one MessagePack map with the names below. Version **{schema}** is that of all messages together; a
site refuses another one by name, except for Stop and StopAck, whose form never changes: a stop is understood in every
version. Messages above {max_bytes:,} B are dropped; an unknown, missing or wrong field is an error, and so is a
number that is not finite. Floats have double precision, in telemetry single; a report has at most {telemetry} B. A *put* has
no answer; a *query* is repeated with the same content until it is answered.

## Keys
All below the vehicle's name, which is the session's namespace (`rov1/op/SITE/cmd`). SITE is the name of the operator's
site; with `--sites`, or at a hub, it is bound to the name in its certificate. *Urgency* is the order in which the
transport serves what waits: STOP, COMMAND, STREAM, TELEMETRY, EVENT, BULK, PICTURE. *Full queue*: a message `waits` for room, or only the
newest is sent. *Share* is the part of a link of known rate (`link.rate_bps`) that a stream may use; messages beyond
it are skipped. Commands, stops and their acknowledgements are never held back. On a narrow link models travel in parts,
each sent after the previous one was confirmed.

*Over QUIC* the transport resends a `stream` until it arrives. A `datagram` is never resent, because the next one replaces it; it
carries a mark in its attachment (sender, number, times, loss and delay, see `common/link/pace.py`), by which each site slows its
streams down on a lossy link. Messages that go `both ways` are sent reliably, and as datagrams until they are answered. Such a question
carries its id and its asker in the attachment and runs once; each copy is answered in the way in which it came, datagrams on
`op/SITE/answer/ASKER` with the question's id. While the robot hears nobody, its reports have no mark, and those that no longer fit the window of their
connection come on `rov/tele/state/stops` and then `rov/tele/state/main`, which operators receive over their connections of those names.

A query of `op/SITE/right` is answered to everybody who has a certificate: what the robot's list of sites says of that name (JSON with `role` and,
for a revoked site, `revoked`; `robots` if it may reach these alone), or null. It is also the question by which a site over QUIC finds out whether the
other end of a silent connection is still there.

*Through a hub* the keys are the same. The hub is a Zenoh router without a namespace: it sees them whole, binds them to the names in the certificates, and answers
`ROBOT/op/SITE/right` itself. A robot there declares the liveliness token `alive` below its name. Robots have the region name `robots`,
operators' sites `operators`; the hub carries messages between the two regions, and none within one.
"""

TAIL = """
## Age
The robot computes `age = its now - the echoed stamp` on its own clock. A command, renewal or input is accepted if its age is
at most the reference (the smallest age of the last ten accepted renewals) plus a time that follows their spread, and at
most `max_age_s`; [safety.md](safety.md) has the limits. Without an echo, or with one of another
boot, only Stop, LeaseRequest, ModelTransfer, ReportRequest, EventsRequest, CatalogueRequest, BlobRequest and CameraRequest are
answered; their answers carry a stamp.

## Answers
A command is answered twice: by its CommandReply (accepted, or refused with a reason whose first number is the measured
value), then by an Event with its `command_id` (`completed` or `failed`). It runs at most once in a boot; a repeated command
gets the same first answer. Refusals and events have a [Reason](#reason): a code with its numbers and names. The operator's
site makes the sentence, and shows an unknown code as received. A stop is sent every 0.2 s with one id until both
acknowledgements have come. A model is confirmed when the robot has returned the hash of the decoded content. Events are
numbered without gaps: a site that misses some asks for them (`op/events`); the robot keeps the last 256.

## Drawing and recordings
The robot lists its drawing and its recorded motions (`op/catalogue`), each by its hash; a site asks for the list at the
first report of a boot and after each event `recorded` that names it. A content is fetched in parts (`op/blob`), each
requested after the previous one has arrived, also after an outage; it is used only if its hash is right. The drawing travels
packed by zlib. Below 100 kbit/s its sketch comes first: at most 8 kB for the arms that come with Farhand, half a minute over `acoustic`.

A content of `farhand.common.wire.motion_encoding` is a MessagePack map: `task`, `frame_names`, `n_dims`, `oriented`, `began` (a stamp)
and `rows`, single precision, little-endian: for each sample the time since the first one [s], the position [m] or pose, and
for each task frame, as perceived at that moment, its origin [m] and one angle [rad] or a quaternion. At most 100 samples in
a second, none more than 0.1 s after the one before, at most 120 s.

| a recording | is | when |
| --- | --- | --- |
| whole | fetched and learned by the site that requested it | the driving operator ended it: `end recording`, Clutch, Execute, the hand let go |
| interrupted | kept; the driving operator may fetch and learn it (`Recover`) | Stop, Disarm, a guard, the lease or the link lost, 10 s without input |
| incomplete | not kept | 0.1 s without a sample, longer than 120 s, not driven at all |

The robot keeps the newest eight until its process ends; after a restart they are lost, and the site reports that. A
restarted site learns none of them on its own: `Recover` fetches those that are not in its library.

## The camera
A site that shows the robot's camera asks for pictures once a second (`op/camera`), and tells how late the last ones came; five
seconds after the last request of the last site no more are taken. The robot answers with the reason if none comes. Each picture is
the newest one, at a rate and of a size that keep within the share of a link of known rate; while the pictures come later than
their own bytes explain, both are lowered, on a link of any rate. Below 30 kbit/s none is sent. A picture is a JPEG file of the
region around the receptacle, with the place of the camera, by which the operator's site draws the expected tool into it.
"""

SHARED_FIELDS = {
    "schema": "Version of all messages together.",
    "seq": "Number of this message among those of its kind from one sender; one that is not above the last is old or a copy.",
    "stamp": "Time of sending, on the robot's clock.",
    "mode": "Mode of the robot at that time.",
    "phase": "Phase of AUTONOMOUS; empty in every other mode.",
    "echo": "Newest stamp of the robot that the sender has received and shown.",
    "session": "Random name of the local site's process, new at each start.",
    "site_name": "Name of the local site.",
    "lease_id": "Id of the lease of the robot's control, which only its holder knows; empty for none.",
    "coupling_id": "Number of the coupling; 0 for none. Each Couple makes a new one.",
    "command_id": "Random name of a command; in an event that of the answered command, empty for none.",
    "stop_id": "Random name of a stop; the same when it is resent.",
    "plan_id": "Number of the preview; 0 for none.",
    "path_id": "Number of the rollout in this boot.",
    "task": "Name of the task.",
    "sha256": "SHA-256 of the model's whole content.",
    "model_sha256": "SHA-256 of the model; empty for none.",
    "content": "Bytes of the model's file, or of a part of it.",
    "reason": "Reason of a refusal; nil otherwise.",
    "accepted": "True if the message was accepted.",
    "complete": "True if all of the model has arrived.",
    "granted": "True if the asking site is in control after this.",
    "holder": "Name of the site in control; empty for none.",
    "n_dims": "Dimension D of positions.",
    "rotation_rad": "Orientation: a rotation vector in space; empty for no rotation.",
    "position_m": "Position in the plane or in space; in telemetry that of the effector.",
    "action": "The requested action.",
    "wish": "Request about the control of the robot.",
    "kind": "Kind of the event: completed, failed, stopped, control, decoupled, paused, ...; a newer robot may have others.",
    "succeeded": "False for a failure or a refusal.",
    "events": "Events, the oldest first, at most 64 at a time.",
    "newest_seq": "Number of the newest event.",
    "after_seq": "Number up to which the asking site has all events.",
    "began": "Time of the execution's beginning; nil before the first.",
    "arrived_after_s": "Time from the beginning to the end of the motion; nil before that end.",
    "overruns": "Control periods of this boot that were skipped because they came too late.",
    "step_s": "Time between two points.",
    "reaches_end": "True if the rollout reaches the end of the motion.",
}

_DROPPED = "a put is dropped and logged, a query not answered"
_REFUSED = "refused in the first answer, written down"

# channel, words of the reply, cause, remedy; and the file that has the words
ERRORS = (
    ("any", "MessagePack was expected", "the bytes do not decode", _DROPPED, "common/wire/codec.py"),
    ("any", "version", "the other site speaks another version", _DROPPED, "common/wire/codec.py"),
    ("any", "a finite number", "NaN or infinity in any field", _DROPPED, "common/wire/codec.py"),
    ("any", "bytes, got", "a message is too large", _DROPPED, "common/wire/codec.py"),
    ("`op/cmd`", "is in control", "another site holds the lease", _REFUSED, "common/wire/reason_words.py"),
    ("`op/cmd`", "you are not in control: the lease ended", "the sender's own lease is over", _REFUSED,
     "common/wire/reason_words.py"),
    ("`op/cmd`, `op/lease`", "came too late: it is", "older than the limit, with the age; a lease is not renewed", _REFUSED,
     "common/wire/reason_words.py"),
    ("`op/cmd`, `op/lease`", "it echoes no report of the robot", "no echo", _REFUSED,
     "common/wire/reason_words.py"),
    ("`op/cmd`, `op/lease`", "it echoes another boot of the robot", "sent before a restart", _REFUSED,
     "common/wire/reason_words.py"),
    ("`op/cmd`, `op/lease`", "it echoes a report that was never sent", "a stamp of the future", _REFUSED,
     "common/wire/reason_words.py"),
    ("`op/cmd`", "is not allowed in", "the table of modes has no such row", _REFUSED,
     "common/wire/reason_words.py"),
    ("`op/cmd`", "a stop travels on its own key", "Stop as a command", _REFUSED, "common/wire/reason_words.py"),
    ("`op/cmd`, `op/model`", "this robot does", "a task that is none of the robot's", _REFUSED,
     "common/wire/reason_words.py"),
    ("`op/cmd`", "is for", "Execute or Preview of a task with a model that was sent for another", _REFUSED,
     "common/wire/reason_words.py"),
    ("`op/cmd`", "the robot has no model", "Execute or Preview of a model that was not confirmed", _REFUSED,
     "common/wire/reason_words.py"),
    ("`op/cmd`", "has not seen the target for", "Execute or Preview while it is unseen; for how long",
     _REFUSED, "common/wire/reason_words.py"),
    ("`op/cmd`", "this task is previewed before it is executed", "Execute from DIRECT", _REFUSED,
     "common/wire/reason_words.py"),
    ("`op/cmd`", "defines no retreat", "Retract without `retract_m` in the task", _REFUSED,
     "common/wire/reason_words.py"),
    ("`op/cmd`", "there is no plan", "Execute without a preview, or of an older boot", _REFUSED,
     "common/wire/reason_words.py"),
    ("`op/cmd`", "the model is not the one that was previewed", "another model", _REFUSED,
     "common/wire/reason_words.py"),
    ("`op/cmd`", "since the preview: preview again", "the robot or its target moved; with how far", _REFUSED,
     "common/wire/reason_words.py"),
    ("`op/cmd`", "s old: preview again", "the preview is too old; with its age", _REFUSED,
     "common/wire/reason_words.py"),
    ("`op/lease`", "held by", "another site is in control, and since when", "granted = false",
     "common/wire/reason_words.py"),
    ("`op/lease`", "has taken over", "a newer process with the same site name has the lease",
     "granted = false", "common/wire/reason_words.py"),
    ("`op/lease`", "handed over to", "the answer to GIVE", "granted = false", "common/wire/reason_words.py"),
    ("`op/lease`", "watching", "the answer to WATCH", "granted = false", "common/wire/reason_words.py"),
    ("`op/model`", "was announced,", "the hash is not that of the content", "refused, nothing is kept",
     "common/wire/reason_words.py"),
    ("`op/model`", "dimensions and", "another dimension or number of frames", "refused, nothing is kept",
     "common/wire/reason_words.py"),
    ("`op/model`", "the frames of task", "a model that was learned in frames of other names", "refused, nothing is kept",
     "common/wire/reason_words.py"),
    ("`op/model`", "variances from", "numbers that nobody demonstrates: covariances, durations, places, slopes",
     "refused with the field, nothing is kept", "common/wire/reason_words.py"),
    ("`op/model`", "is in control", "another site is in control of the robot", "refused, nothing is kept",
     "common/wire/reason_words.py"),
    ("`op/model`", "no terminal component", "no component where a demonstration ended",
     "refused, nothing is kept", "common/wire/reason_words.py"),
    ("`op/pose`", "stale_refused", "another lease or coupling, or too old", "ignored and counted in telemetry",
     "remote_site/supervision/operator_session.py"),
    ("any query", "NOT DELIVERED", "no answer within 15 s, shown by the local site", "it may have been heard",
     "common/wire/reason_words.py"),
)  # fmt: skip
