"""A listener that reads nothing: it holds up neither stops nor reports of the others, and is dropped by name."""

from __future__ import annotations

import contextlib
import itertools
import threading
import time

import pytest
import zenoh

from farhand.common.wire import keys
from farhand.common.wire.codec import decode, encode
from farhand.common.wire.messages import (
    Event,
    EventsReply,
    EventsRequest,
    ExecutionReport,
    ReportRequest,
    Stop,
)
from tests.messages import said
from tests.robustness.neighbours import VEHICLE, DeafPeer, RawPeer
from tests.robustness.raw_operator import RawOperator

TELEMETRY = f"{VEHICLE}/{keys.TELEMETRY.key}"
_numbers = itertools.count(1)
PRIORITIES = (zenoh.Priority.REAL_TIME, zenoh.Priority.INTERACTIVE_HIGH, zenoh.Priority.DATA)


def acknowledged_after_s(operator: RawOperator, n: int) -> list[float]:
    """Time from each of some stops to its acknowledgement."""
    acks: dict[str, threading.Event] = {}

    def take(data: bytes) -> None:
        for stop_id, event in list(acks.items()):
            if stop_id.encode() in data:
                event.set()

    operator.link.subscribe(keys.STOP_ACK, take)
    took_s = []
    for _ in range(n):
        stop = Stop(stop_id=f"timed {next(_numbers)} end", site_name="tester")
        acks[stop.stop_id] = threading.Event()
        began_s = time.monotonic()
        operator.link.send(keys.STOP, encode(stop))
        assert acks[stop.stop_id].wait(30.0), f"no acknowledgement within 30 s: {took_s}"
        took_s.append(time.monotonic() - began_s)
    return took_s


def ask_for_much(peer: RawPeer, over: threading.Event, priorities: tuple[zenoh.Priority, ...]) -> None:
    """Ask for the robot's events at some priorities, no faster than its inbox takes it, until the session is closed."""
    with contextlib.suppress(zenoh.ZError):
        while not over.wait(0.03):
            for priority in priorities:
                peer.session.get(
                    f"{VEHICLE}/{keys.EVENTS.of('deaf')}", zenoh.handlers.Callback(lambda _: None, indirect=False),
                    payload=encode(EventsRequest()), timeout=600.0, priority=priority,
                    congestion_control=zenoh.CongestionControl.BLOCK,
                )  # fmt: skip


class Events:
    """All that the robot announces, from now on."""

    def __init__(self, operator: RawOperator):
        self._seen: list[bytes] = []
        operator.link.subscribe(keys.EVENT, self._seen.append)

    def dropped(self) -> list[str]:
        """What it says of listeners; on a busy machine its full inbox may drop messages, too, which it says in other words."""
        events = [decode(data, Event) for data in list(self._seen)]
        dropped = [said(event) for event in events if event.kind == "dropped"]
        return [text for text in dropped if "a listener that read nothing was dropped: 127.0.0.1:" in text]


@pytest.mark.parametrize(
    ("n_peers", "priorities"),
    [(1, PRIORITIES), (3, PRIORITIES), *((1, (priority,)) for priority in PRIORITIES)],
)
def test_who_asks_for_much_and_reads_nothing_holds_up_no_stop_and_is_dropped(
    n_peers, priorities, endpoint, operator
):
    """At each priority that the robot answers with, so that its queues for that listener are full."""
    acknowledged_after_s(operator, 70)  # each is an event: the answers below are large
    assert len(operator.ask(keys.EVENTS, EventsRequest(), EventsReply).events) >= 32
    over, events, took_s = threading.Event(), Events(operator), []
    peers = [DeafPeer(endpoint) for _ in range(n_peers)]
    asking = [
        threading.Thread(target=ask_for_much, args=(peer.raw, over, priorities), daemon=True)
        for peer in peers
    ]
    try:
        for peer in peers:
            peer.raw.listen(f"{VEHICLE}/rov/**")
            peer.raw.until_it_hears(TELEMETRY)
            peer.stop_reading()
        for thread in asking:
            thread.start()
        deadline_s = time.monotonic() + 90.0
        while len(events.dropped()) < n_peers:
            assert time.monotonic() < deadline_s, events.dropped()
            took_s += acknowledged_after_s(operator, 5)
            operator.ask(keys.REPORT, ReportRequest(), ExecutionReport)
        took_s += acknowledged_after_s(operator, 10)
        # Who is held up waits until the listener is dropped, each time; a busy machine is late now and then.
        slowest = sorted(took_s, reverse=True)
        assert slowest[len(slowest) // 10] < 0.5, slowest
        assert slowest[0] < 5.0, slowest
    finally:
        over.set()
        for peer in peers:
            peer.close()
        for thread in asking:
            if thread.ident is not None:
                thread.join(60.0)
