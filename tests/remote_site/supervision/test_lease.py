from __future__ import annotations

import pytest

from farhand.common.wire.messages import Wish
from farhand.common.wire.reason_words import sentence
from farhand.remote_site.supervision.lease import Lease


def test_the_first_request_wins_and_the_second_is_told_who_holds_it():
    lease = Lease(3.0)
    assert lease.request("a", "ann", 0.0) is None
    refusal = lease.request("b", "bob", 1.5)
    assert "ann" in sentence(refusal) and "2 s" in sentence(refusal)
    assert lease.holder == "ann"


def test_a_renewal_keeps_the_lease_and_its_id():
    lease = Lease(3.0)
    lease.request("a", "ann", 0.0)
    first = lease.lease_id
    for now_s in (2.9, 5.8, 8.7):
        assert lease.request("a", "ann", now_s) is None
    assert lease.lease_id == first and not lease.expire(11.6)


def test_silence_frees_it_for_others_under_another_id():
    lease = Lease(3.0)
    lease.request("a", "ann", 0.0)
    first = lease.lease_id
    assert not lease.expire(3.0)
    assert lease.expire(3.1) and not lease.expire(3.2)
    assert (lease.holder, lease.lease_id) == ("", "")
    assert sentence(lease.freed_because) == "none of its messages arrived in time for 3 s"
    assert lease.request("b", "bob", 3.3) is None
    assert lease.lease_id not in ("", first)
    lease.request("b", "bob", 3.4, Wish.WATCH)
    assert (lease.holder, sentence(lease.freed_because)) == ("", "it only watches")
    assert not lease.is_held_by("a", first)


def test_an_old_holder_gets_a_new_lease_when_nobody_took_it():
    lease = Lease(3.0)
    lease.request("a", "ann", 0.0)
    first = lease.lease_id
    assert lease.request("a", "ann", 10.0) is None
    assert lease.lease_id != first


def test_only_session_and_id_together_prove_it():
    lease = Lease(3.0)
    assert not lease.is_held_by("", "")
    lease.request("a", "ann", 0.0)
    assert lease.is_held_by("a", lease.lease_id)
    assert not lease.is_held_by("b", lease.lease_id)
    assert not lease.is_held_by("a", "made up")


def test_the_holder_is_told_who_asks_and_hands_over():
    lease = Lease(3.0)
    lease.request("a", "ann", 0.0)
    assert lease.request("b", "bob", 0.5, Wish.ASK) is not None
    assert lease.asked_by == "bob"
    before = lease.lease_id
    assert "bob" in sentence(lease.request("a", "ann", 1.0, Wish.GIVE))
    assert lease.holder == "bob" and lease.lease_id != before and lease.asked_by == ""
    assert lease.request("b", "bob", 1.5) is None


def test_giving_without_anybody_who_asked_keeps_the_lease():
    lease = Lease(3.0)
    lease.request("a", "ann", 0.0)
    assert lease.request("a", "ann", 1.0, Wish.GIVE) is None
    assert lease.holder == "ann"


def test_who_asked_and_went_silent_does_not_ask_any_more():
    lease = Lease(3.0)
    lease.request("a", "ann", 0.0)
    lease.request("b", "bob", 0.5, Wish.ASK)
    for now_s in (1.5, 2.5, 3.6):
        lease.request("a", "ann", now_s)
    assert lease.asked_by == ""


def test_a_watcher_never_has_it_and_gives_up_what_it_had():
    lease = Lease(3.0)
    assert lease.request("a", "ann", 0.0, Wish.WATCH) is not None
    assert lease.holder == ""
    lease.request("a", "ann", 0.1)
    assert lease.request("a", "ann", 0.2, Wish.WATCH) is not None
    assert lease.holder == ""


def test_a_restarted_site_reclaims_its_lease_and_its_earlier_process_only_watches():
    lease = Lease(3.0)
    lease.request("old", "ann", 0.0)
    before = lease.lease_id
    assert lease.request("new", "ann", 1.0) is None
    assert lease.lease_id != before
    assert "has taken over" in sentence(lease.request("old", "ann", 1.1))
    assert lease.is_held_by("new", lease.lease_id)


def test_an_old_holder_gets_it_back_unasked_if_nobody_took_it():
    lease = Lease(3.0)
    lease.request("a", "ann", 0.0)
    assert lease.request("a", "ann", 10.0) is None
    assert lease.holder == "ann"


def test_an_old_request_of_an_earlier_process_cannot_take_it_from_the_present_one():
    lease = Lease(3.0)
    lease.request("old", "ann", 0.0)
    assert lease.expire(10.0)
    assert lease.request("new", "ann", 10.1) is None
    assert "has taken over" in sentence(lease.request("old", "ann", 10.2))
    assert lease.session == "new"
    assert lease.request("new", "ann", 10.3) is None


def test_a_restarted_site_reclaims_its_lease_by_what_is_surely_of_now():
    lease = Lease(3.0)
    lease.request("present", "ann", 0.0)
    assert "held by ann" in sentence(lease.request("unknown", "ann", 1.0, fresh=False))
    assert lease.session == "present"
    assert lease.request("restarted", "ann", 1.1, fresh=True) is None


# Who hears nothing ------------------------------------------------------------------------------


def test_a_site_that_heard_nothing_since_it_lost_the_control_does_not_get_it_back():
    lease = Lease(3.0)
    lease.request("a", "ann", 0.0, heard_s=-0.1)
    for now_s in (3.5, 4.5, 60.0):
        assert "waiting to hear" in sentence(lease.request("a", "ann", now_s, heard_s=-0.1))
        assert "waiting to hear" in sentence(lease.request("a", "ann", now_s, heard_s=None))
    assert lease.request("a", "ann", 61.0, heard_s=60.9) is None


def test_a_site_that_never_heard_the_robot_gives_way_to_one_that_does():
    lease = Lease(3.0)
    assert lease.request("deaf", "ann", 0.0, fresh=False, heard_s=None) is None
    assert "held by ann" in sentence(lease.request("deaf too", "bob", 0.5, fresh=False, heard_s=None))
    assert "held by ann" in sentence(lease.request("late", "bob", 0.5, fresh=False, heard_s=-9.0))
    assert lease.request("b", "bob", 1.0, heard_s=0.9) is None
    assert "waiting to hear" in sentence(lease.request("deaf", "ann", 1.5, fresh=False, heard_s=None))
    assert lease.holder == "bob"


def test_a_holder_that_hears_is_not_taken_from_by_one_that_hears_too():
    lease = Lease(3.0)
    assert lease.request("a", "ann", 0.0, fresh=False, heard_s=None) is None
    assert lease.request("a", "ann", 0.5, heard_s=0.4) is None
    assert "held by ann" in sentence(lease.request("b", "bob", 1.0, heard_s=0.9))


def test_a_renewal_that_comes_late_renews_for_less():
    lease = Lease(3.0)
    lease.request("a", "ann", 0.0)
    lease.request("a", "ann", 2.0, late_s=0.9)
    assert not lease.expire(4.0) and lease.expire(4.2)
    lease.request("a", "ann", 5.0)
    lease.request("a", "ann", 5.5, late_s=2.0)  # which never takes away what it had
    assert not lease.expire(8.0) and lease.expire(8.1)


@pytest.mark.parametrize("name", ["", " ", "\t\n", "\u200b", "--", "\u2066\u2069"])
def test_nobody_holds_it_who_does_not_say_who_it_is(name: str):
    lease = Lease(3.0)
    assert "must name its session, and a site" in sentence(lease.request("a", name, 0.0))
    assert "must name its session, and a site" in sentence(lease.request("a", name, 0.0, Wish.ASK))
    assert "must name its session, and a site" in sentence(lease.request("", "ann", 0.0))
    assert (lease.holder, lease.lease_id, lease.asked_by) == ("", "", "")


def test_a_second_process_of_the_same_name_locks_the_first_one_out_only_while_it_lives():
    lease = Lease(3.0)
    lease.request("first", "operator", 0.0)
    assert lease.request("second", "operator", 1.0, heard_s=0.9) is None
    for now_s in (1.5, 2.5):
        lease.request("second", "operator", now_s)
        assert "started again" in sentence(lease.request("first", "operator", now_s, heard_s=now_s - 0.1))
    assert "waiting to hear" in sentence(
        lease.request("first", "operator", 6.0, heard_s=0.5)
    )  # an echo of the past
    assert lease.request("first", "operator", 6.1, heard_s=6.0) is None
    assert lease.session == "first"
