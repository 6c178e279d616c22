from __future__ import annotations

from typing import Any

from farhand.common.control_mode import ControlMode
from farhand.common.wire import keys
from farhand.common.wire.codec import decode, encode
from farhand.common.wire.messages import Event, EventKind, EventsRequest, Message, Stamp
from farhand.common.wire.reasons import Code, because, in_words
from farhand.remote_site.supervision.events import Events


class Told:
    """Events, and where they go."""

    def __init__(self) -> None:
        self.announced: list[Message] = []
        self.written: list[dict[str, Any]] = []
        self.events = Events(self._announce, lambda: Stamp("boot", 7), lambda **f: self.written.append(f))

    def _announce(self, channel: object, message: Message) -> None:
        assert channel is keys.EVENT
        self.announced.append(message)

    def tell(self, n: int) -> None:
        for k in range(n):
            self.events.tell(EventKind.HOLDING, in_words(f"number {k}"), ControlMode.HOLD)

    def after(self, seq: int) -> list[int]:
        return [event.seq for event in self.events.answer(EventsRequest(after_seq=seq)).events]


def test_an_event_is_announced_and_written_down_with_everything_it_says():
    told = Told()
    why = because(Code.FORCE, force_n=401.0, limit_n=400.0)
    told.events.tell(EventKind.STOPPED, why, ControlMode.STOPPED, succeeded=False, who="ann")
    (event,) = told.announced
    assert isinstance(event, Event)
    assert (event.seq, event.stamp, event.reason, event.who) == (1, Stamp("boot", 7), why, "ann")
    (row,) = told.written
    assert (row["kind"], row["who"], row["measured"]) == ("stopped", "ann", 401.0)
    assert row["text"] == "the force of 401 N is above 400 N"


def test_a_refusal_is_written_down_and_not_announced():
    told = Told()
    told.events.refused("arm", "ann", because(Code.PREVIEW_TOO_OLD, age_s=70.0), ControlMode.HOLD)
    assert not told.announced
    (row,) = told.written
    assert (row["kind"], row["what"], row["who"], row["text"], row["measured"]) == (
        "refused", "arm", "ann", "the preview is 70 s old: preview again", 70.0,
    )  # fmt: skip


def test_what_was_missed_is_told_again_in_order_as_much_as_fits():
    told = Told()
    told.tell(100)
    assert told.after(0) == list(range(1, 65))
    assert told.after(64) == list(range(65, 101))
    assert told.after(100) == []
    assert told.events.answer(EventsRequest()).newest_seq == 100


def test_only_the_newest_are_kept():
    told = Told()
    told.tell(300)
    assert told.after(0)[0] == 45


def test_a_text_of_any_length_fits_the_wire():
    told = Told()
    told.events.tell(EventKind.FAILED, in_words("x" * 10_000), ControlMode.HOLD)
    (event,) = told.announced
    assert isinstance(event, Event) and decode(encode(event), Event) == event
