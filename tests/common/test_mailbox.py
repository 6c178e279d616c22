from __future__ import annotations

import threading

from hypothesis import given, settings
from hypothesis import strategies as st

from farhand.common.event_loop import Mailbox


@settings(deadline=None, derandomize=True, max_examples=50)
@given(keep=st.integers(1, 5), items=st.lists(st.integers(), max_size=12))
def test_the_newest_items_wait_and_the_oldest_give_way(keep, items):
    box: Mailbox[int] = Mailbox(keep)
    for item in items:
        box.put(item)
    assert box.take_all() == items[-keep:]
    assert box.take_all() == []


def test_waiting_ends_with_the_first_item():
    box: Mailbox[str] = Mailbox()
    assert not box.wait(0.0)
    threading.Thread(target=lambda: box.put("here")).start()
    assert box.wait(30.0)
    assert box.take_all() == ["here"]
    assert not box.wait(0.0)
