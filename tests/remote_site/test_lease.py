from __future__ import annotations

from remote_site.lease import Lease


def test_the_first_request_wins_and_the_second_is_told_who_holds_it():
    lease = Lease(3.0)
    assert lease.request("a", "ann", 0.0) == ""
    refusal = lease.request("b", "bob", 1.5)
    assert "ann" in refusal and "1.5 s" in refusal
    assert lease.holder == "ann"


def test_a_renewal_keeps_the_lease_and_its_id():
    lease = Lease(3.0)
    lease.request("a", "ann", 0.0)
    first = lease.lease_id
    for now_s in (2.9, 5.8, 8.7):
        assert lease.request("a", "ann", now_s) == ""
    assert lease.lease_id == first and not lease.expire(11.6)


def test_silence_frees_it_for_others_under_another_id():
    lease = Lease(3.0)
    lease.request("a", "ann", 0.0)
    first = lease.lease_id
    assert not lease.expire(3.0)
    assert lease.expire(3.1) and not lease.expire(3.2)
    assert (lease.holder, lease.lease_id) == ("", "")
    assert lease.request("b", "bob", 3.3) == ""
    assert lease.lease_id not in ("", first)
    assert not lease.is_held_by("a", first)


def test_an_old_holder_gets_a_new_lease_when_nobody_took_it():
    lease = Lease(3.0)
    lease.request("a", "ann", 0.0)
    first = lease.lease_id
    assert lease.request("a", "ann", 10.0) == ""
    assert lease.lease_id != first


def test_only_session_and_id_together_prove_it():
    lease = Lease(3.0)
    assert not lease.is_held_by("", "")
    lease.request("a", "ann", 0.0)
    assert lease.is_held_by("a", lease.lease_id)
    assert not lease.is_held_by("b", lease.lease_id)
    assert not lease.is_held_by("a", "made up")
