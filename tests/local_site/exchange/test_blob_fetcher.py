"""Contents fetched in parts from the robot's real catalogue, whatever the link does to questions and answers."""

from __future__ import annotations

import hashlib
import random
import zlib
from collections.abc import Callable

from hypothesis import given, settings
from hypothesis import strategies as st

from farhand.common.link.interface import Answered
from farhand.common.wire.codec import decode, encode
from farhand.common.wire.keys import Channel
from farhand.common.wire.messages import BlobReply, BlobRequest, Stamp
from farhand.common.wire.packed import MOST_BYTES, pack, unpack
from farhand.local_site.exchange.fetching import BlobFetcher
from farhand.local_site.exchange.requests import Requests
from farhand.remote_site.supervision.recordings import Catalogue

NOW = Stamp("boot", 1)
NARROW_BPS = 9600.0  # parts of 480 B
NOISE = random.Random(0).randbytes(4000)  # cannot be packed


class Unruly:
    """A link that holds every question until it is told what becomes of it. Time passes by hand."""

    def __init__(self) -> None:
        self.catalogue = Catalogue()
        self.waiting: list[tuple[BlobRequest, Answered]] = []
        self.late: list[Callable[[], None]] = []
        self.n_parts, self.now_s = 0, 0.0
        self.damage = False
        self.inquiries = Requests(self, lambda job: job(), lambda: self.now_s, ask_timeout_s=1.0)
        self.fetcher = BlobFetcher(self.inquiries, NARROW_BPS)

    def ask(self, channel: Channel, data: bytes, timeout_s: float, answered: Answered) -> None:
        self.waiting.append((decode(data, BlobRequest), answered))

    def send(self, channel: Channel, data: bytes) -> None: ...

    def subscribe(self, channel: Channel, deliver: Callable) -> None: ...

    def serve(self, channel: Channel, handle: Callable) -> None: ...

    def limit(self, channel: Channel, bytes_per_s: float) -> None: ...

    def close(self) -> None: ...

    def become(self, fate: str) -> None:
        """What becomes of the oldest question, a while later."""
        if self.waiting:
            request, answered = self.waiting.pop(0)
            reply = self.catalogue.part(request, NOW)
            self.n_parts += 1
            if self.damage:
                reply = BlobReply(sha256=reply.sha256, size=reply.size, offset=reply.offset,
                                  content=bytes(len(reply.content)), stamp=NOW)  # fmt: skip
            data = encode(reply)
            match fate:
                case "arrives":
                    answered(data)
                case "twice":
                    answered(data)
                    answered(data)
                case "late":
                    self.late.append(lambda: answered(data))
                case "lost":
                    answered(None)
        if fate == "the late ones arrive":
            while self.late:
                self.late.pop()()
        self.now_s += 2.5
        self.inquiries.tick(self.now_s)


def fetched(link: Unruly, content: bytes) -> list[bytes | None]:
    sha256 = hashlib.sha256(content).hexdigest()
    got: list[bytes | None] = []
    link.fetcher.fetch(sha256, got.append)
    return got


FATES = st.lists(st.sampled_from(["arrives", "twice", "late", "lost", "the late ones arrive"]), max_size=40)


@settings(deadline=None, derandomize=True, max_examples=150)
@given(st.binary(min_size=1, max_size=4000), FATES)
def test_any_loss_repetition_and_order_gives_the_same_bytes(content: bytes, fates: list[str]):
    link = Unruly()
    link.catalogue.show(content)
    got = fetched(link, content)
    for fate in fates:
        link.become(fate)
    while not got:
        link.become("arrives")
    assert got == [content]


def test_after_a_cut_it_goes_on_where_it_was():
    link, content = Unruly(), NOISE[:2560]
    link.catalogue.show(content)
    sha256 = hashlib.sha256(content).hexdigest()
    got = fetched(link, content)
    for _ in range(3):
        link.become("arrives")
    assert link.fetcher.share(sha256) == 3 * 480 / len(pack(content))
    for _ in range(20):
        link.become("lost")
    before = link.n_parts
    while not got:
        link.become("arrives")
    assert got == [content] and link.n_parts - before == 3  # of six
    assert link.fetcher.share(sha256) is None


def test_what_was_asked_for_last_comes_first():
    link, scene, motion = Unruly(), NOISE[:2000], NOISE[-600:]
    link.catalogue.show(scene)
    link.catalogue.show(motion)
    first, second = fetched(link, scene), fetched(link, motion)
    while not second:
        assert not first
        link.become("arrives")
    while not first:
        link.become("arrives")
    assert (first, second) == ([scene], [motion])


def test_what_the_robot_does_not_have_is_not_to_be_had():
    link = Unruly()
    got = fetched(link, b"nowhere")
    link.become("arrives")
    assert got == [None]


def test_what_arrives_damaged_is_begun_anew_and_given_up_at_last():
    link, content = Unruly(), NOISE[:1400]
    link.catalogue.show(content)
    link.damage = True
    got = fetched(link, content)
    for _ in range(4):
        link.become("arrives")
    link.damage = False
    while not got:
        link.become("arrives")
    assert got == [content]
    link.damage = True
    got = fetched(link, content)
    while not got:
        link.become("arrives")
    assert got == [None]


def test_what_can_be_packed_travels_packed():
    link, content = Unruly(), b"far hand " * 1000
    link.catalogue.show(content)
    got = fetched(link, content)
    link.become("arrives")
    assert got == [content]


@given(st.binary(max_size=200), st.binary(max_size=200))
def test_only_the_content_of_that_hash_is_unpacked(content: bytes, other: bytes):
    sha256 = hashlib.sha256(content).hexdigest()
    assert unpack(pack(content), sha256) == unpack(content, sha256) == content
    if other != content:
        assert unpack(pack(other), sha256) is None and unpack(other, sha256) is None


def test_what_would_become_too_large_is_not_unpacked():
    content = bytes(MOST_BYTES + 1)
    assert unpack(zlib.compress(content), hashlib.sha256(content).hexdigest()) is None
