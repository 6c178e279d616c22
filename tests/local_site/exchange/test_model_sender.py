from __future__ import annotations

import queue
from typing import Any

from farhand.common.link.interface import Request
from farhand.common.model.model_file import content_hash
from farhand.common.model.model_file import encode as encode_model
from farhand.common.wire import keys
from farhand.common.wire.codec import decode, encode
from farhand.common.wire.messages import ModelReply, ModelTransfer, Stamp
from farhand.common.wire.reasons import in_words
from farhand.local_site.exchange.model_sender import ModelSender
from farhand.local_site.exchange.requests import Requests
from farhand.local_site.teaching.lesson import LearnedModel
from tests.loopback import joined
from tests.strategies import learned


def a_model(seed: int = 0) -> LearnedModel:
    model = learned(seed=seed)
    content = encode_model(model)
    return LearnedModel(model, content, content_hash(content))


class Sending:
    """A sender on the test's own thread: what it would do later waits in `jobs`."""

    def __init__(self) -> None:
        self.remote, local = joined()
        self.jobs: queue.SimpleQueue = queue.SimpleQueue()
        self.inquiries = Requests(local, self.jobs.put, lambda: 5.0, ask_timeout_s=0.1)
        self.settled: list[tuple[str, bool]] = []
        self.sender = ModelSender(self.inquiries, lambda: 5.0, "session")

    def send(self, model: LearnedModel, task: str = "planar", ask_first: bool = False) -> None:
        self.sender.send(task, model, lambda *said: self.settled.append(said), ask_first)

    @property
    def confirmed_sha256(self) -> str:
        return self.sender.confirmed_sha256("planar")

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
    sending.send(model)
    assert sending.sender.sending_sha256("planar") and not sending.confirmed_sha256
    sending.settle()
    assert got == [
        ModelTransfer(session="session", task="planar", sha256=model.sha256, version=1, content=model.content)
    ]
    assert sending.confirmed_sha256 == model.sha256 and not sending.sender.sending_sha256("planar")
    assert sending.settled == [("confirmed after 0.00 s", True)]


def test_a_refusal_is_told_in_the_robots_words():
    sending = Sending()
    sending.serve(accepted=False, reason=in_words("another task"))
    sending.send(a_model())
    sending.settle()
    assert not sending.confirmed_sha256 and not sending.sender.sending_sha256("planar")
    assert sending.settled == [("refused: another task", False)]


def test_the_confirmation_of_another_model_is_none():
    sending = Sending()
    sending.serve(sha256="0" * 64)
    sending.send(a_model())
    sending.settle()
    assert not sending.confirmed_sha256
    assert sending.settled == [("refused: the robot confirmed another model", False)]


def test_the_same_model_is_under_way_once():
    sending, model = Sending(), a_model()
    got = sending.serve()
    sending.send(model)
    sending.send(model)
    sending.settle()
    assert sending.jobs.empty() and len(got) == 1


def test_a_refused_model_leaves_the_confirmed_one():
    sending, first = Sending(), a_model()
    sending.serve()
    sending.send(first)
    sending.jobs.get(timeout=60.0)()
    sending.serve(accepted=False, reason=in_words("no"))
    sending.send(a_model(seed=1))
    sending.settle()
    assert sending.confirmed_sha256 == first.sha256


def test_on_a_narrow_link_a_model_goes_in_parts_each_after_the_one_before_was_confirmed():
    sending, model = Sending(), a_model()
    sending.sender = ModelSender(sending.inquiries, lambda: 5.0, "session", 9600.0)
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
    sending.send(model)
    while sending.sender.sending_sha256("planar"):
        sending.jobs.get(timeout=60.0)()
    assert bytes(got) == model.content
    assert sending.confirmed_sha256 == model.sha256


def test_what_the_robot_has_is_not_sent_again():
    sending, first, second = Sending(), a_model(), a_model(1)
    got = sending.serve()
    for model in (first, second, first):
        sending.send(model)
        sending.jobs.get(timeout=60.0)()
        assert sending.confirmed_sha256 == model.sha256
    sending.inquiries.close()
    asked = got[-1]
    assert (asked.sha256, asked.content, asked.size) == (first.sha256, b"", len(first.content))


def test_a_restarted_robot_that_has_it_no_more_gets_it_again():
    sending, model = Sending(), a_model()
    sending.serve()
    sending.send(model)
    sending.jobs.get(timeout=60.0)()
    got: list[ModelTransfer] = []

    def answer(request: Request) -> None:
        got.append(part := decode(request.data, ModelTransfer))
        complete = bool(part.content)
        reply = ModelReply(accepted=True, sha256=part.sha256, complete=complete, stamp=Stamp("later", 1))
        request.answer(encode(reply))

    sending.remote.serve(keys.MODEL, answer)
    sending.send(model)
    for _ in range(2):
        sending.jobs.get(timeout=60.0)()
    sending.inquiries.close()
    assert [bool(part.content) for part in got] == [False, True] and not sending.sender.sending_sha256(
        "planar"
    )


def test_models_of_several_tasks_go_one_after_the_other():
    sending, first, second = Sending(), a_model(), a_model(1)
    got = sending.serve()
    sending.send(first, "one")
    sending.send(second, "two")
    assert sending.sender.sending_sha256("one") and sending.sender.sending_sha256("two") and len(got) == 1
    sending.jobs.get(timeout=60.0)()
    sending.settle()
    assert [(part.task, part.sha256) for part in got] == [("one", first.sha256), ("two", second.sha256)]
    assert sending.sender.confirmed_sha256("two") == second.sha256
    sending.sender.forget_confirmed()
    assert not any(map(sending.sender.confirmed_sha256, ("one", "two")))


def test_a_newer_model_takes_the_place_of_an_older_one_of_its_task_alone():
    sending, first, older, newer = Sending(), a_model(), a_model(1), a_model(2)
    got = sending.serve()
    sending.send(first, "one")
    sending.send(older, "two")
    sending.send(newer, "two")
    assert sending.settled == [("a newer one is sent in its place", True)]
    assert sending.sender.newest_sha256("two") == newer.sha256
    sending.jobs.get(timeout=60.0)()
    sending.settle()
    assert [part.sha256 for part in got] == [first.sha256, newer.sha256]


def test_whoever_asks_first_learns_that_the_robot_has_it_without_sending_it():
    sending, model = Sending(), a_model()
    got = sending.serve()
    sending.send(model, ask_first=True)
    sending.settle()
    assert [part.content for part in got] == [b""]
    assert sending.settled == [("the robot has it already", True)]
    assert sending.confirmed_sha256 == model.sha256
