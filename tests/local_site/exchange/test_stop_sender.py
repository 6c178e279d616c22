from __future__ import annotations

from farhand.common.wire import keys
from farhand.common.wire.codec import decode
from farhand.common.wire.messages import Stamp, Stop, StopAck
from farhand.local_site.exchange.stop_sender import StopSender
from tests.loopback import Loopback


def a_sender() -> tuple[StopSender, Loopback]:
    link, _ = Loopback.pair()
    return StopSender(link, "ann"), link


def sent(link: Loopback) -> list[Stop]:
    assert {channel for channel, _ in link.sent} <= {keys.STOP}
    return [decode(data, Stop) for _, data in link.sent]


def ack(stop_id: str, standing: bool) -> StopAck:
    return StopAck(stop_id=stop_id, standing=standing, stamp=Stamp("boot", 1))


def test_a_stop_goes_out_at_once_in_the_sites_name():
    sender, link = a_sender()
    sender.press(10.0)
    assert [stop.site_name for stop in sent(link)] == ["ann"]
    assert sender.unacknowledged


def test_it_is_resent_every_fifth_of_a_second_with_one_id_until_the_robot_stands():
    sender, link = a_sender()
    sender.press(10.0)
    for since_s, n_sent in ((0.19, 1), (0.21, 2), (0.4, 2), (0.42, 3), (5.0, 4), (5.1, 4)):
        sender.tick(10.0 + since_s)
        assert len(sent(link)) == n_sent
    (stop_id,) = {stop.stop_id for stop in sent(link)}
    sender.acknowledged(ack(stop_id, standing=False))
    assert sender.unacknowledged
    sender.tick(15.3)
    assert len(sent(link)) == 5
    sender.acknowledged(ack(stop_id, standing=True))
    sender.tick(20.0)
    assert len(sent(link)) == 5 and not sender.unacknowledged


def test_nothing_is_sent_that_nobody_pressed():
    sender, link = a_sender()
    sender.tick(10.0)
    sender.acknowledged(ack("another", standing=True))
    assert sender.status is None and not link.sent


def test_the_acknowledgement_of_another_stop_does_not_count():
    sender, _ = a_sender()
    sender.press(10.0)
    sender.acknowledged(ack("another", standing=True))
    assert sender.status is not None and not sender.status.received


def test_acknowledgements_that_overtake_each_other_do_not_take_back_that_it_stands():
    sender, link = a_sender()
    sender.press(10.0)
    stop_id = sent(link)[0].stop_id
    sender.acknowledged(ack(stop_id, standing=True))
    sender.acknowledged(ack(stop_id, standing=False))
    assert sender.status is not None and sender.status.standing


def test_pressing_again_resends_and_once_it_is_settled_makes_a_new_stop():
    sender, link = a_sender()
    sender.press(10.0)
    sender.press(10.05)
    first, second = sent(link)
    assert first.stop_id == second.stop_id
    assert sender.status is not None and sender.status.pressed_s == 10.0
    sender.acknowledged(ack(first.stop_id, standing=True))
    sender.press(12.0)
    assert sent(link)[-1].stop_id != first.stop_id
    assert sender.status.pressed_s == 12.0
    assert not sender.status.received
