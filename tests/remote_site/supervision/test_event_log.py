from __future__ import annotations

from typing import Any

from farhand.common.mode_table import ControlMode
from farhand.common.wire import keys
from farhand.common.wire.codec import decode, encode
from farhand.common.wire.messages import Event, EventKind, EventsRequest, Message, Stamp
from farhand.common.wire.reasons import N_MORE, Code, because, in_words
from farhand.remote_site.supervision.event_log import Events


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


def test_of_a_flood_of_events_some_are_told_and_the_others_are_counted():
    """What one kind of neighbour causes pushes out nothing of another kind, and nothing is lost silently."""
    now_ns, why = [0], because(Code.FORCE, force_n=401.0, limit_n=400.0)
    told: list[Event] = []

    def announce(_channel: object, message: Message) -> None:
        assert isinstance(message, Event)
        told.append(message)

    events = Events(announce, lambda: Stamp("boot", now_ns[0]), lambda **_: None)
    for number in range(10_000):
        now_ns[0] = int(number * 1e6)  # ten seconds in all
        events.tell(EventKind.STOPPED, why, ControlMode.STOPPED, who="ann")
    assert len(told) == 32 + 19, "at once, and then two in a second"
    counted = [each.value for event in told for each in event.reason.values if each.name == N_MORE]
    assert len(told) + sum(map(int, counted)) + events._flood._counted[EventKind.STOPPED] == 10_000
    events.tell(EventKind.CONTROL, why, ControlMode.STOPPED, who="bob")
    assert told[-1].kind is EventKind.CONTROL


def test_refusals_share_one_budget_and_what_the_robot_itself_says_is_always_told():
    told, why = Told(), because(Code.PREVIEW_TOO_OLD, age_s=70.0)
    for number in range(500):
        told.events.refused("arm", f"site {number}", why, ControlMode.HOLD)
    assert len(told.written) == 32 and "more like it" not in told.written[-1]["text"]
    told.tell(500)
    for number in range(500):
        told.events.tell(
            EventKind.COMPLETED, why, ControlMode.HOLD, who="ann", command_id=f"command {number}"
        )
    assert len(told.written) == 32 + 1000
