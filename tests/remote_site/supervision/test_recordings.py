"""Recording how the robot is driven: begun, sampled, ended by its operator or by something else, kept."""

from __future__ import annotations

import hashlib

import numpy as np
import pytest

from farhand.common.mode_table import Action, ControlMode
from farhand.common.wire.messages import BlobRequest, CatalogueReply, Event, EventKind
from farhand.common.wire.motion_encoding import MAX_DURATION_S, RecordedMotion
from farhand.remote_site.supervision.motion_recorder import Recorded
from farhand.remote_site.supervision.recordings import Catalogue
from tests.messages import said
from tests.remote_site.bench import DT_S, Bench


def recording() -> Bench:
    """An operator drives, and the robot records it."""
    bench = Bench().coupled()
    assert bench.command(Action.RECORD).accepted
    return bench


def offers(bench: Bench) -> CatalogueReply:
    return bench.robot.recordings.catalogue.list(bench.robot.stamp())


def content(bench: Bench) -> bytes:
    (offer,) = offers(bench).recordings
    request = BlobRequest(sha256=offer.sha256, n_bytes=65_536)
    data = bench.robot.recordings.catalogue.part(request, bench.robot.stamp()).content
    assert hashlib.sha256(data).hexdigest() == offer.sha256
    return data


def ended(bench: Bench) -> Event:
    (event,) = bench.events(EventKind.RECORDED)
    assert event.who == "ann"
    return event


def test_it_begins_with_the_hand_and_has_a_sample_with_its_frames_for_each_control_period():
    bench = recording()
    bench.run(0.4)
    assert bench.robot.recordings.recorded_s == 0.0
    began_ns, seen = bench.time.ns, []
    for k in range(100):
        bench.hand(0.001 * k, 0.0)
        before = bench.position_m
        bench.run(DT_S)
        seen.append((before, bench.robot.sensing.frames[0].b))
    assert bench.robot.recordings.recorded_s == pytest.approx(99 * DT_S)
    assert bench.command(Action.END_RECORDING).accepted
    assert ended(bench).succeeded and bench.mode is ControlMode.DIRECT
    motion = RecordedMotion.from_bytes(content(bench))
    assert motion.began.t_ns == began_ns + round(DT_S * 1e9)
    time_s, points, origins, _ = motion.samples()
    np.testing.assert_allclose(time_s, DT_S * np.arange(100), atol=1e-5)
    np.testing.assert_allclose(points, [point for point, _ in seen], atol=1e-6)
    np.testing.assert_allclose(origins[:, 0], [origin for _, origin in seen], atol=1e-6)
    assert np.ptp(origins[:, 0], axis=0).max() > 0.01  # the target moves


@pytest.mark.parametrize(
    ("end", "whole"),
    [
        (lambda b: b.command(Action.CLUTCH), True),
        (lambda b: b.drive(DT_S, 0.02, released=True), True),
        (lambda b: b.command(Action.EXECUTE, model_sha256=b.send_model().sha256), True),
        (lambda b: b.stop(), False),
        (lambda b: b.command(Action.DISARM), False),
        (lambda b: b.run(3.5, present=False), False),
        (lambda b: b.run(10.5), False),
    ],
    ids=["clutch", "let go", "execute", "stop", "disarm", "lease lost", "no input"],
)
def test_it_ends_with_direct_and_is_whole_if_its_operator_ended_it(end, whole: bool):
    bench = recording()
    bench.drive(0.5, 0.01)
    end(bench)
    assert bench.mode is not ControlMode.DIRECT and bench.robot.recordings.recorded_s is None
    (offer,) = offers(bench).recordings
    assert (offer.whole, offer.site_name) == (whole, "ann")
    assert ended(bench).succeeded is whole
    assert whole or "it can be recovered" in said(ended(bench))


def test_a_tenth_of_a_second_without_a_sample_ends_it_as_incomplete():
    bench = recording()
    bench.drive(0.5, 0.01)
    bench.time.advance(0.1)  # the control loop was late
    bench.drive(0.1, 0.01)
    assert bench.mode is ControlMode.DIRECT
    assert not offers(bench).recordings and not ended(bench).succeeded
    assert "0.12 s without a sample" in said(ended(bench)) and "not kept" in said(ended(bench))


def test_a_target_that_is_not_seen_for_longer_than_it_can_be_predicted_ends_it():
    bench = recording()
    bench.drive(0.5, 0.01)
    bench.sight.seen = False
    bench.drive(0.3, 0.01)
    assert bench.robot.recordings.recorded_s is not None
    bench.drive(0.2, 0.01)
    assert "without a sample" in said(ended(bench)) and not offers(bench).recordings


def test_it_is_bounded_in_time():
    bench = recording()
    bench.drive(MAX_DURATION_S + 0.1, 0.01)
    assert "longer than 120 s" in said(ended(bench)) and not offers(bench).recordings
    assert bench.robot.recordings.recorded_s is None


def test_a_robot_that_was_not_driven_has_recorded_nothing():
    bench = recording()
    bench.run(0.2)
    bench.command(Action.CLUTCH)
    assert "nothing recorded" in said(ended(bench)) and not offers(bench).recordings


def test_a_target_that_is_not_seen_at_first_is_no_beginning():
    bench = recording()
    bench.sight.seen = False
    bench.run(0.4)
    bench.drive(0.2, 0.01)
    assert "nothing recorded: 0.12 s without a sample" in said(ended(bench))
    assert bench.robot.recordings.recorded_s is None


def test_a_second_record_and_a_second_end_are_answered_and_change_nothing():
    bench = recording()
    bench.drive(0.2, 0.01)
    again = bench.command(Action.RECORD)
    ending = bench.ending(again.command_id)
    assert ending is not None and "already" in said(ending)
    bench.drive(0.2, 0.01)
    bench.command(Action.END_RECORDING)
    ending = bench.ending(bench.command(Action.END_RECORDING).command_id)
    assert ending is not None and "nothing is being recorded" in said(ending)
    assert offers(bench).recordings[0].duration_s == pytest.approx(0.4, abs=0.03)


def test_record_without_driving_is_refused():
    reply = Bench().armed().command(Action.RECORD)
    assert not reply.accepted and "only in DIRECT" in said(reply)


def test_only_the_newest_eight_are_kept():
    catalogue = Catalogue()
    for k in range(10):
        motion = RecordedMotion(
            task="t",
            frame_names=("goal",),
            n_dims=2,
            oriented=False,
            began=Bench().robot.stamp(),
            rows=bytes(k),
        )
        catalogue.offer(Recorded(motion, "ann", float(k), whole=True))
    listed = catalogue.list(Bench().robot.stamp()).recordings
    assert [offer.duration_s for offer in listed] == [2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]
    assert len(catalogue._contents) == 8
