from __future__ import annotations

import pytest

from farhand.common.clock import BootClock
from farhand.common.mode_table import Action
from farhand.common.task import TaskSet
from farhand.common.wire.messages import Command, Heartbeat, LeaseReply, LeaseRequest, Stamp
from farhand.common.wire.reason_words import sentence
from farhand.common.wire.reasons import Reason
from farhand.evaluation.harness.steered_world import SteppedTime
from farhand.remote_site.config import RemoteConfig
from farhand.remote_site.supervision.operator_session import OperatorSession
from tests.messages import said
from tests.remote_site.planar import TASK


class Operators:
    """Several sites that talk to one robot."""

    def __init__(self) -> None:
        self.time = SteppedTime()
        self.clock = BootClock("boot", self.time)
        self.contact = OperatorSession(RemoteConfig(), self.clock)

    def echo(self, age_s: float) -> Stamp:
        return Stamp("boot", self.time.ns - round(age_s * 1e9))

    def ask(self, who: str, age_s: float | None = 0.1, after_s: float = 1.0) -> LeaseReply:
        self.time.advance(after_s)
        echo = None if age_s is None else self.echo(age_s)
        now = Stamp("boot", self.time.ns)
        request = LeaseRequest(session=f"session of {who}", site_name=who, echo=echo)
        return self.contact.answer(request, TaskSet([TASK]), now)

    def command(self, who: str, lease_id: str, age_s: float = 0.1) -> Reason | None:
        return self.contact.command_refusal(
            Command(
                command_id="c", session=f"session of {who}", lease_id=lease_id, action=Action.ARM,
                echo=self.echo(age_s),
            )
        )  # fmt: skip


def test_the_lease_is_granted_without_an_echo_and_says_what_the_robot_is():
    reply = Operators().ask("ann", age_s=None)
    assert reply.granted and reply.lease_id and reply.holder == "ann"
    assert (reply.tasks, reply.n_dims, reply.newest_age_s) == ((TASK.name,), TASK.n_dims, None)
    assert reply.stamp.boot == "boot"


def test_who_cannot_have_heard_the_robot_yet_keeps_the_lease_for_the_largest_round_trip():
    operators = Operators()
    lease_id = operators.ask("ann", age_s=None).lease_id
    assert all(operators.ask("ann", age_s=None).lease_id == lease_id for _ in range(15))
    assert "came too late" in said(operators.ask("ann", age_s=None))


def test_who_has_heard_the_robot_must_echo_it_to_keep_the_lease():
    operators = Operators()
    operators.ask("ann", age_s=None)
    assert operators.ask("ann").granted
    assert "no report" in said(operators.ask("ann", age_s=None))


def test_another_site_is_refused_and_learns_the_holder_but_not_the_lease():
    operators = Operators()
    operators.ask("ann")
    reply = operators.ask("bob")
    assert not reply.granted and "held by ann" in said(reply)
    assert reply.holder == "ann" and reply.lease_id == ""


def test_the_age_that_the_robot_measured_goes_back():
    assert Operators().ask("ann", 0.25).newest_age_s == pytest.approx(0.25)


def test_a_renewal_that_comes_too_late_does_not_keep_the_lease():
    operators = Operators()
    lease_id = operators.ask("ann").lease_id
    for n in range(3):
        reply = operators.ask("ann", age_s=5.0)
        assert not reply.granted and "too late" in said(reply)
        assert operators.contact.stale_refused == n + 1
    operators.time.advance(0.1)
    operators.contact.lease.expire(operators.clock.now_s())
    assert "the lease ended" in sentence(operators.command("ann", lease_id))


def test_one_renewal_that_comes_too_late_does_not_end_the_lease():
    operators = Operators()
    lease_id = operators.ask("ann").lease_id
    late = operators.ask("ann", age_s=5.0)
    assert not late.granted and late.lease_id == lease_id
    assert operators.ask("ann").granted


def test_another_site_does_not_change_what_is_usual():
    operators = Operators()
    operators.ask("ann", 2.0)
    for _ in range(3):
        operators.ask("ann", 2.0, after_s=0.5)
        operators.ask("bob", 0.01, after_s=0.5)
    assert operators.contact.usual_age_s == pytest.approx(2.0)


def test_a_command_counts_from_the_holder_and_fresh_only():
    operators = Operators()
    lease_id = operators.ask("ann").lease_id
    assert operators.command("ann", lease_id) is None
    assert "ann is in control" in sentence(operators.command("bob", lease_id))
    reason = operators.command("ann", lease_id, age_s=4.0)
    assert reason is not None and "too late" in sentence(reason) and reason.measured == pytest.approx(4.0)
    assert operators.contact.stale_refused == 1


def test_a_site_that_lost_the_control_on_the_way_and_has_it_back_is_told_to_press_again():
    operators = Operators()
    earlier = operators.ask("ann").lease_id
    operators.time.advance(3.1)
    assert operators.ask("ann").granted
    assert "it is back: press again" in sentence(operators.command("ann", earlier))


def test_a_site_that_another_of_its_name_took_over_from_is_told_so_and_not_to_press_again():
    """Two operators who gave their sites one name."""
    operators = Operators()
    first = operators.ask("ann").lease_id
    request = LeaseRequest(session="another process", site_name="ann", echo=operators.echo(0.1))
    second = operators.contact.answer(request, TaskSet([TASK]), Stamp("boot", operators.time.ns))
    assert second.granted
    for reason in (operators.command("ann", first), operators.ask("ann").reason):
        told = sentence(reason)
        assert "another site named ann has taken over" in told and "--site-name" in told
        assert "press again" not in told


def test_a_lease_request_of_a_former_holder_does_not_keep_the_watchdog_quiet():
    operators = Operators()
    lease_id = operators.ask("ann").lease_id
    operators.time.advance(3.1)
    assert operators.ask("bob").granted
    assert "lease" in sentence(operators.contact.lost_reason(lease_id, operators.clock.now_s()))


def test_only_the_holders_heartbeats_are_heard():
    operators = Operators()
    contact, lease_id = operators.contact, operators.ask("ann").lease_id
    operators.time.advance(1.0)
    contact.heartbeat(Heartbeat(session="session of bob", seq=9, echo=operators.echo(0.0)))
    assert contact.heartbeat_seq == 0
    assert contact.lost_reason(lease_id, operators.clock.now_s())
    contact.heartbeat(Heartbeat(session="session of ann", seq=7, echo=operators.echo(0.1)))
    assert contact.heartbeat_seq == 7
    assert contact.heartbeat_received_ns == operators.time.ns
    assert not contact.lost_reason(lease_id, operators.clock.now_s())


def test_heartbeats_that_overtake_each_other_count_once_each():
    operators = Operators()
    operators.ask("ann")
    for seq in (5, 4, 5):
        operators.time.advance(0.1)
        operators.contact.heartbeat(Heartbeat(session="session of ann", seq=seq, echo=operators.echo(0.1)))
    assert operators.contact.heartbeat_seq == 5
    assert operators.time.ns - operators.contact.heartbeat_received_ns == 200_000_000


def test_a_message_may_be_older_while_the_link_lets_reports_out_rarely_and_no_longer():
    operators = Operators()
    lease_id = ""
    for _ in range(5):
        lease_id = operators.ask("ann", age_s=0.6).lease_id
    assert operators.command("ann", lease_id, age_s=0.8) is None
    assert "came too late" in sentence_of(operators.command("ann", lease_id, age_s=1.0))
    operators.contact.reports_every(0.2)  # two of them and 0.1 s
    assert operators.command("ann", lease_id, age_s=1.0) is None
    assert "came too late" in sentence_of(operators.command("ann", lease_id, age_s=1.15))
    operators.contact.reports_every(3.0)  # at most 0.6 s
    assert operators.command("ann", lease_id, age_s=1.15) is None
    assert "came too late" in sentence_of(operators.command("ann", lease_id, age_s=1.25))
    operators.contact.reports_every(0.0)
    assert "came too late" in sentence_of(operators.command("ann", lease_id, age_s=1.0))


def sentence_of(reason: Reason | None) -> str:
    assert reason is not None
    return sentence(reason)
