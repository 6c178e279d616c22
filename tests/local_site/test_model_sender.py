from __future__ import annotations

import queue
from typing import Any

from common import keys
from common.codec import decode, encode
from common.link import Request
from common.messages import ModelReply, ModelTransfer, Stamp
from common.model_file import content_hash
from common.model_file import encode as encode_model
from local_site.inquiries import Inquiries
from local_site.model_sender import ModelSender
from local_site.notices import Notice
from local_site.taught import LearnedModel
from tests.loopback import Loopback
from tests.strategies import learned


def a_model(seed: int = 0) -> LearnedModel:
    model = learned(seed=seed)
    content = encode_model(model)
    return LearnedModel(model, content, content_hash(content))


class Sending:
    """A sender on the test's own thread: what it would do later waits in `jobs`."""

    def __init__(self) -> None:
        self.remote, local = Loopback.pair()
        self.jobs: queue.SimpleQueue = queue.SimpleQueue()
        self.inquiries = Inquiries(local, self.jobs.put, lambda: 5.0, ask_timeout_s=0.1)
        self.notices: list[Notice] = []
        self.sender = ModelSender(self.inquiries, "planar", self.notices.append, lambda: 5.0)

    def settle(self) -> None:
        self.jobs.get(timeout=60.0)()
        self.inquiries.close()

    def serve(self, **reply: Any) -> list[ModelTransfer]:
        """Have the robot answer so; what it gets is collected."""
        got: list[ModelTransfer] = []

        def answer(request: Request) -> None:
            got.append(decode(request.data, ModelTransfer))
            usual = {"accepted": True, "sha256": got[-1].sha256, "stamp": Stamp("boot", 1)}
            request.answer(encode(ModelReply(**(usual | reply))))

        self.remote.serve(keys.MODEL, answer)
        return got


def test_a_model_counts_once_the_robot_has_confirmed_its_hash():
    sending, model = Sending(), a_model()
    got = sending.serve()
    sending.sender.send(model)
    assert sending.sender.sending and not sending.sender.confirmed_sha256
    sending.settle()
    assert got == [ModelTransfer(task="planar", sha256=model.sha256, version=1, content=model.content)]
    assert sending.sender.confirmed_sha256 == model.sha256 and not sending.sender.sending
    assert sending.notices[-1].good and model.sha256[:8] in sending.notices[-1].text


def test_a_refusal_is_told_in_the_robots_words():
    sending = Sending()
    sending.serve(accepted=False, reason="another task")
    sending.sender.send(a_model())
    sending.settle()
    assert not sending.sender.confirmed_sha256 and not sending.sender.sending
    assert not sending.notices[-1].good and "another task" in sending.notices[-1].text


def test_the_confirmation_of_another_model_is_none():
    sending = Sending()
    sending.serve(sha256="0" * 64)
    sending.sender.send(a_model())
    sending.settle()
    assert not sending.sender.confirmed_sha256
    assert not sending.notices[-1].good


def test_the_same_model_is_under_way_once():
    sending, model = Sending(), a_model()
    got = sending.serve()
    sending.sender.send(model)
    sending.sender.send(model)
    sending.settle()
    assert sending.jobs.empty() and len(got) == 1


def test_a_refused_model_leaves_the_confirmed_one():
    sending, first = Sending(), a_model()
    sending.serve()
    sending.sender.send(first)
    sending.jobs.get(timeout=60.0)()
    sending.serve(accepted=False, reason="no")
    sending.sender.send(a_model(seed=1))
    sending.settle()
    assert sending.sender.confirmed_sha256 == first.sha256


def test_on_a_narrow_link_a_model_goes_in_parts_each_after_the_one_before_was_confirmed():
    sending, model = Sending(), a_model()
    sending.sender = ModelSender(sending.inquiries, "planar", sending.notices.append, lambda: 5.0, 9600.0)
    got = bytearray()

    def answer(request: Request) -> None:
        part = decode(request.data, ModelTransfer)
        assert part.offset == len(got) and part.size == len(model.content)
        got.extend(part.content)
        complete = len(got) == part.size
        reply = ModelReply(
            accepted=True, sha256=part.sha256, complete=complete, received=len(got), stamp=Stamp("boot", 1)
        )  # fmt: skip
        request.answer(encode(reply))

    sending.remote.serve(keys.MODEL, answer)
    sending.sender.send(model)
    while sending.sender.sending:
        sending.jobs.get(timeout=60.0)()
    assert bytes(got) == model.content
    assert sending.sender.confirmed_sha256 == model.sha256


def test_what_the_robot_has_is_not_sent_again():
    sending, first, second = Sending(), a_model(), a_model(1)
    got = sending.serve()
    for model in (first, second, first):
        sending.sender.send(model)
        sending.jobs.get(timeout=60.0)()
        assert sending.sender.confirmed_sha256 == model.sha256
    sending.inquiries.close()
    asked = got[-1]
    assert (asked.sha256, asked.content, asked.size) == (first.sha256, b"", len(first.content))


def test_a_restarted_robot_that_has_it_no_more_gets_it_again():
    sending, model = Sending(), a_model()
    sending.serve()
    sending.sender.send(model)
    sending.jobs.get(timeout=60.0)()
    got: list[ModelTransfer] = []

    def answer(request: Request) -> None:
        got.append(part := decode(request.data, ModelTransfer))
        complete = bool(part.content)
        reply = ModelReply(accepted=True, sha256=part.sha256, complete=complete, stamp=Stamp("later", 1))
        request.answer(encode(reply))

    sending.remote.serve(keys.MODEL, answer)
    sending.sender.send(model)
    for _ in range(2):
        sending.jobs.get(timeout=60.0)()
    sending.inquiries.close()
    assert [bool(part.content) for part in got] == [False, True] and not sending.sender.sending
