from __future__ import annotations

from dataclasses import replace

import pytest
from msgspec import structs

from farhand.common.errors import InvalidModel
from farhand.common.model.model_file import content_hash, decode
from farhand.common.task import TaskSet
from farhand.common.wire.messages import ModelTransfer, Stamp
from farhand.remote_site.motion.model_store import _MOST_ARRIVING, ModelStore
from farhand.remote_site.motion.model_trial import StoredModel
from tests.messages import said
from tests.remote_site.planar import TASK, planar_model, transfer
from tests.strategies import learned

NOW = Stamp("boot", 5)


def damaged() -> ModelTransfer:
    content = bytearray(transfer().content)
    content[len(content) // 2] ^= 1
    return transfer(content=bytes(content))


REFUSED = {
    "a wrong hash": (transfer(sha256="0" * 64), "sha256"),
    "one bit that fell over": (damaged(), "sha256"),
    "another task": (transfer(task="other"), "not 'other'"),
    "another dimension": (transfer(learned(3)), "2 dimensions"),
    "another number of frames": (transfer(learned(n_frames=2)), "1 frames"),
    "no model at all": (transfer(content=b"hello", sha256=content_hash(b"hello")), ""),
    "nothing": (transfer(content=b"", sha256=content_hash(b"")), ""),
}


def store_of() -> ModelStore:
    """A robot's that does two tasks."""
    return ModelStore(TaskSet([TASK, structs.replace(TASK, name="other")]))


def test_what_fits_is_kept_and_confirmed_by_the_hash_of_what_arrived():
    store = ModelStore(TaskSet([TASK]))
    reply = store.answer(transfer(), NOW)
    assert reply.accepted and reply.sha256 == content_hash(transfer().content)
    stored = store.get(reply.sha256)
    assert stored is not None and stored is store.newest
    assert stored.model == decode(transfer().content)


def received(store: ModelStore, sent: ModelTransfer) -> StoredModel:
    assert store.answer(sent, NOW).accepted and store.newest is not None
    return store.newest


@pytest.mark.parametrize("case", REFUSED)
def test_what_does_not_fit_is_refused_with_the_reason_and_changes_nothing(case: str):
    store = ModelStore(TaskSet([TASK]))
    kept = received(store, transfer())
    wrong, words = REFUSED[case]
    reply = store.answer(wrong, NOW)
    assert not reply.accepted and words in said(reply)
    assert store.newest is kept and store.get(kept.sha256) is kept
    if wrong.sha256 != kept.sha256:
        assert store.get(wrong.sha256) is None


def test_a_model_without_an_end_is_refused():
    endless = planar_model()
    try:
        endless = replace(endless, terminal=endless.terminal & False)
    except InvalidModel:
        return  # it cannot even be made
    assert "terminal" in said(ModelStore(TaskSet([TASK])).answer(transfer(endless), NOW))


def test_an_older_model_stays_available_by_its_hash():
    store = ModelStore(TaskSet([TASK]))
    first, second = received(store, transfer()), received(store, transfer(learned()))
    assert store.newest is second and store.get(first.sha256) is first


def test_a_model_for_a_task_with_more_frames_is_taken_by_that_task():
    two = structs.replace(TASK, frame_names=("a", "b"), landmarks={"a": TASK.target})
    assert (
        ModelStore(TaskSet([two]))
        .answer(transfer(replace(learned(n_frames=2), frame_names=("a", "b"))), NOW)
        .accepted
    )


def parts(whole: ModelTransfer, n_bytes: int) -> list[ModelTransfer]:
    size = len(whole.content)
    return [
        structs.replace(whole, size=size, offset=at, content=whole.content[at : at + n_bytes])
        for at in range(0, size, n_bytes)
    ]


def test_a_model_in_parts_counts_when_the_last_one_has_come():
    store, sent = ModelStore(TaskSet([TASK])), parts(transfer(), 200)
    replies = [store.answer(part, NOW) for part in sent]
    assert len(sent) > 2 and all(reply.accepted for reply in replies)
    assert [reply.complete for reply in replies] == [False] * (len(sent) - 1) + [True]
    assert store.get(transfer().sha256) is not None


def test_a_part_that_comes_twice_or_too_early_changes_nothing():
    store, sent = ModelStore(TaskSet([TASK])), parts(transfer(), 200)
    assert store.answer(sent[1], NOW).received == 0
    assert [store.answer(sent[0], NOW).received for _ in range(2)] == [200, 200]
    reply = [store.answer(part, NOW) for part in [sent[2], sent[1], *sent[1:]]][-1]
    assert reply.complete and reply.sha256 == transfer().sha256


def test_several_models_arrive_in_parts_side_by_side():
    store, one, other = store_of(), parts(transfer(), 200), parts(transfer(learned(), task="other"), 200)
    n = min(len(one), len(other)) - 1
    for pair in zip(one[:n], other[:n], strict=True):
        assert not any(store.answer(part, NOW).complete for part in pair)
    for rest in (one[n:], other[n:]):
        assert [store.answer(part, NOW) for part in rest][-1].complete
    assert [stored.task.name for stored in store.all()] == [TASK.name, "other"]


def test_of_too_many_that_arrive_in_parts_the_one_not_heard_of_for_longest_begins_anew():
    store, seeds = store_of(), range(_MOST_ARRIVING + 1)
    firsts = [transfer(sha256=f"{seed:064x}", size=400, content=bytes(200)) for seed in seeds]
    for first in [*firsts[:-1], firsts[0], firsts[-1]]:
        assert store.answer(first, NOW).received == 200
    asked = [structs.replace(first, content=b"") for first in firsts]
    kept = [store.answer(ask, NOW).received for ask in [asked[0], *asked[2:], asked[1]]]
    assert kept == [200] * _MOST_ARRIVING + [0]


def test_a_model_is_checked_by_and_kept_for_the_task_that_it_was_sent_for():
    store = store_of()
    assert store.answer(transfer(), NOW).accepted
    stored = store.get(transfer().sha256)
    assert stored is not None and stored.task is TASK and stored.label == f"planar {stored.sha256[:8]}"
    again = transfer(task="other")
    asks = structs.replace(again, size=len(again.content), content=b"")
    assert not store.answer(asks, NOW).complete  # there is one with this hash, but it is one of the first
    assert store.answer(again, NOW).accepted and store.get(again.sha256) != stored


def test_a_task_that_is_not_done_is_refused_with_the_first_part_naming_those_that_are():
    reply = store_of().answer(parts(transfer(task="third"), 200)[0], NOW)
    assert not reply.accepted and "'planar' and 'other', not 'third'" in said(reply)


def test_parts_that_do_not_make_what_was_announced_are_refused_and_can_be_sent_again():
    store, sent = ModelStore(TaskSet([TASK])), parts(transfer(), 200)
    wrong = structs.replace(sent[-1], content=bytes(len(sent[-1].content)))
    reply = [store.answer(part, NOW) for part in [*sent[:-1], wrong]][-1]
    assert not reply.accepted and "sha256" in said(reply)
    assert [store.answer(part, NOW).complete for part in sent][-1]


def test_a_part_without_content_asks_whether_a_model_is_here():
    store, whole = ModelStore(TaskSet([TASK])), transfer()
    asks = structs.replace(whole, size=len(whole.content), content=b"")
    unknown = store.answer(asks, NOW)
    assert unknown.accepted and not unknown.complete and unknown.received == 0
    first = received(store, whole)
    received(store, transfer(learned()))
    known = store.answer(asks, NOW)
    assert known.accepted and known.complete and known.sha256 == whole.sha256
    assert store.newest is first
