from __future__ import annotations

from farhand.common.mode_table import ControlMode
from farhand.common.wire.messages import CommandReply, Stamp
from farhand.remote_site.supervision.admission import CommandLog


def reply(command_id: str, accepted: bool = True) -> CommandReply:
    return CommandReply(
        command_id=command_id, accepted=accepted, mode=ControlMode.HOLD, stamp=Stamp("boot", 1)
    )


def test_each_command_has_the_answer_that_it_got():
    log = CommandLog()
    assert log.reply_to("a") is None
    log.remember(reply("a"))
    log.remember(reply("b", accepted=False))
    assert log.reply_to("a") == reply("a")
    assert log.reply_to("b") == reply("b", accepted=False)


def test_a_flood_of_commands_does_not_fill_the_memory_and_keeps_the_newest():
    log = CommandLog()
    for n in range(5000):
        log.remember(reply(str(n)))
    kept = [n for n in range(5000) if log.reply_to(str(n)) is not None]
    assert kept == list(range(5000 - len(kept), 5000)) and 1000 < len(kept) < 5000
