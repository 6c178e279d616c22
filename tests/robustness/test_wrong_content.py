"""Well-formed messages with wrong content: the robot answers why not, and nothing has changed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import msgpack
import numpy as np
import pytest

from farhand.common.mode_table import Action, ControlMode
from farhand.common.model.manifold import POSE
from farhand.common.model.model_file import content_hash
from farhand.common.model.model_file import encode as encode_model
from farhand.common.wire import keys
from farhand.common.wire.codec import encode
from farhand.common.wire.messages import ModelReply, ModelTransfer, OperatorInput, Stamp
from tests.messages import said
from tests.remote_site.planar import short_strokes
from tests.robustness.raw_operator import SESSION, RawOperator
from tests.strategies import learned


def rewritten(change: Callable[[dict[str, Any]], object]) -> bytes:
    """A model's bytes with something changed, and a hash that fits them."""
    content = msgpack.unpackb(encode_model(short_strokes()))
    change(content)
    return msgpack.packb(content) or b""


def with_a_nan(content: dict[str, Any]) -> None:
    content["parts"]["means"] = np.float32(np.nan).tobytes() + content["parts"]["means"][4:]


def of_another_shape(content: dict[str, Any]) -> None:
    content["shape"][0] += 1


BAD_CONTENTS = {
    "nan": (rewritten(with_a_nan), "means: finite numbers"),
    "shape": (rewritten(of_another_shape), "priors: "),
    "schema": (rewritten(lambda content: content.update(schema=1)), "schema: version 3, got 1"),
    "unknown": (rewritten(lambda content: content.update(colour="red")), "colour: no such field"),
    "missing": (rewritten(lambda content: content["parts"].pop("means")), "means: a field that is missing"),
    "truncated": (encode_model(short_strokes())[:-7], "truncated"),
    "foreign": (b"\x89PNG\r\n\x1a\n", "truncated or of another kind"),
    "dimensions": (encode_model(learned(3)), "2 dimensions"),
    "poses": (encode_model(learned(POSE)), "these are poses"),
    "frames": (encode_model(learned(n_frames=2)), "1 frames"),
    "empty": (b"", "truncated or of another kind"),
}


@pytest.mark.parametrize("kind", BAD_CONTENTS)
def test_a_bad_model_is_refused_with_its_field(kind, operator):
    content, reason = BAD_CONTENTS[kind]
    transfer = ModelTransfer(session=SESSION, task="planar", sha256=content_hash(content), content=content)
    assert_refused(operator, transfer, reason)


def test_a_model_that_is_not_what_was_announced_is_refused(operator):
    good = encode_model(short_strokes())
    assert_refused(
        operator, ModelTransfer(session=SESSION, task="planar", sha256="0" * 64, content=good), "sha256"
    )
    foreign = ModelTransfer(session=SESSION, task="juggling", sha256=content_hash(good), content=good)
    assert_refused(operator, foreign, "not 'juggling'")


def assert_refused(operator: RawOperator, transfer: ModelTransfer, reason: str) -> None:
    before = operator.report().model
    reply = operator.ask(keys.MODEL, transfer, ModelReply)
    assert not reply.accepted
    assert reason in said(reply)
    assert operator.report().model == before


@pytest.mark.parametrize(
    ("action", "fields", "reason"),
    [
        (Action.DISARM, {"lease_id": "stolen"}, "it is back: press again"),
        (Action.DISARM, {"session": "another"}, "tester is in control"),
        (Action.DISARM, {"echo": None}, "echoes no report"),
        (Action.DISARM, {"echo": Stamp("another boot", 1)}, "another boot"),
        (Action.DISARM, {"echo": "future"}, "never sent"),
        (Action.ABORT, {}, "not allowed in HOLD"),
        (Action.STOP, {}, "its own key"),
        (Action.EXECUTE, {"model_sha256": "f" * 64}, "no model ffffffff"),
        (Action.EXECUTE, {"task": "juggling"}, "'juggling'"),
    ],
)
def test_a_command_that_must_not_run_is_answered_with_the_reason(action, fields, reason, operator):
    if fields.get("echo") == "future":
        now = operator.report().stamp
        fields = {"echo": Stamp(now.boot, now.t_ns + 10**12)}
    reply = operator.command(action, **fields)
    assert not reply.accepted
    assert reason in said(reply)
    assert operator.report().mode is ControlMode.HOLD


def test_a_hand_in_space_does_not_move_a_robot_in_the_plane(operator):
    """It is fresh, and of the present coupling and lease; only its dimension is wrong."""
    before = operator.report().position_m
    assert operator.command(Action.COUPLE).accepted
    for n in range(5):
        now = operator.report()
        hand = OperatorInput(
            seq=n, echo=now.stamp, lease_id=operator.lease_id, coupling_id=now.coupling_id,
            position_m=(0.1 * n, 0.2 * n, 0.3 * n),
        )  # fmt: skip
        operator.link.send(keys.INPUT, encode(hand))
    assert operator.report().position_m == before
