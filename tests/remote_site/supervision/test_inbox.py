"""Messages that wait for the next control period: nobody takes the place of another."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from farhand.common.mode_table import Action
from farhand.common.wire.messages import (
    BlobRequest,
    CatalogueRequest,
    Command,
    EventsRequest,
    Heartbeat,
    LeaseRequest,
    Message,
    ModelTransfer,
    MoveTarget,
    OperatorInput,
    ReportRequest,
    Stamp,
    Stop,
)
from farhand.remote_site.supervision.inbox import Inbox
from farhand.remote_site.supervision.lease import Lease

NOW = Stamp("boot", 1)


def messages(session: str, lease_id: str) -> dict[str, Message]:
    """One of each kind from a site."""
    return {
        "command": Command(command_id="1", session=session, lease_id=lease_id, action=Action.ARM, echo=NOW),
        "input": OperatorInput(seq=1, echo=NOW, lease_id=lease_id, coupling_id=1, position_m=(0.1, 0.2)),
        "target": MoveTarget(echo=NOW, lease_id=lease_id, position_m=(0.1, 0.2)),
        "heartbeat": Heartbeat(session=session, seq=1, echo=NOW),
        "lease": LeaseRequest(session=session, site_name="a site"),
        "model": ModelTransfer(session=session, task="planar", sha256="0" * 64, content=b""),
    }


STRANGERS = [
    *messages("a stranger", "a lease").values(), *messages("", "").values(), ReportRequest(), EventsRequest(),
    CatalogueRequest(), BlobRequest(sha256="0" * 64, n_bytes=1),
]  # fmt: skip


@pytest.fixture
def lease() -> Lease:
    lease = Lease(3.0)
    assert lease.request("the holder", "ann", 0.0) is None
    return lease


def is_done(inbox: Inbox, done: list[str], what: str, periods: int) -> bool:
    for _ in range(periods):
        for job in inbox.take():
            job()
    return what in done


@pytest.mark.parametrize("kind", messages("", ""))
@pytest.mark.parametrize("flood", [*STRANGERS, Stop(stop_id="theirs", site_name="a site")], ids=repr)
def test_whatever_strangers_send_what_the_holder_sent_is_done_in_the_next_period(kind, flood, lease):
    inbox, done = Inbox(lease), list[str]()
    inbox.put(messages("the holder", lease.lease_id)[kind], lambda: done.append("the holder's"))
    for _ in range(1000):
        inbox.put(flood, lambda: done.append("a stranger's"))
    assert is_done(inbox, done, "the holder's", 1)


@pytest.mark.parametrize("flood", [*STRANGERS, *messages("the holder", "lease").values()], ids=repr)
def test_no_other_message_takes_the_place_of_a_stop_or_of_the_robots_own_answers(flood, lease):
    inbox, done = Inbox(lease), list[str]()
    inbox.put(Stop(stop_id="mine", site_name="ann"), lambda: done.append("stop"))
    inbox.put_own(lambda: done.append("own"))
    for _ in range(1000):
        inbox.put(flood, lambda: None)
        inbox.note(lambda: None)
    assert is_done(inbox, done, "stop", 1) and "own" in done


def test_while_the_robot_is_free_nobody_is_its_holder():
    inbox, done = Inbox(Lease(3.0)), list[str]()
    for message in messages("", "").values():
        inbox.put(message, lambda: done.append("nobody's"))
    inbox.put(messages("bob", "")["lease"], lambda: done.append("bob's"))
    assert is_done(inbox, done, "bob's", 1)


@given(st.lists(st.sampled_from(STRANGERS), max_size=2000))
def test_a_period_has_a_bounded_number_of_jobs_and_memory(flood):
    lease = Lease(3.0)
    lease.request("the holder", "ann", 0.0)
    inbox = Inbox(lease)
    for number, message in enumerate(flood):
        inbox.put(message, lambda: None)
        inbox.put(Stop(stop_id=str(number), site_name="bob"), lambda: None)
    assert len(inbox) <= 2 * 256 + 64
    while len(inbox):
        assert 0 < len(inbox.take()) <= 64 + 16 + 1


def test_a_sender_is_told_to_slow_down_long_before_the_oldest_is_dropped(lease):
    """What waits then is all done, within less than half a second at 50 Hz."""
    for message in (*STRANGERS, Stop(stop_id="theirs", site_name="a site")):
        inbox, done, sent = Inbox(lease), list[str](), 0
        while inbox.put(message, lambda done=done: done.append("done")):
            sent += 1
        for _ in range(25):
            for job in inbox.take():
                job()
        assert len(done) == sent + 1 and len(inbox) == 0
