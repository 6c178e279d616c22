"""Commands run at most once in a boot: what arrives again is answered, not repeated."""

from __future__ import annotations

from collections import OrderedDict

from farhand.common.wire.messages import CommandReply

_KEPT = 4096


class CommandLog:
    """The answers that were given, by command id."""

    def __init__(self) -> None:
        self._replies: OrderedDict[str, CommandReply] = OrderedDict()

    def reply_to(self, command_id: str) -> CommandReply | None:
        """The answer that this command got before, or None for a new one."""
        return self._replies.get(command_id)

    def remember(self, reply: CommandReply) -> None:
        """Keep an answer."""
        self._replies[reply.command_id] = reply
        if len(self._replies) > _KEPT:
            self._replies.popitem(last=False)
