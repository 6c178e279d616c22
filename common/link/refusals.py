"""Refused connections and messages, each reason told once in a while: the transport itself only logs or drops them.

The transport writes its log to standard output, in its own words. A process that serves others reads it there.
"""

from __future__ import annotations

import contextlib
import os
import re
import sys
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import zenoh

from farhand.common.clock import elapsed_s
from farhand.common.link.access import AccessWatch, explain_right, obeys_all
from farhand.common.link.questions import in_reader, reply_to
from farhand.common.link.quic import site_in
from farhand.common.link.session import Declare
from farhand.common.log import loop_logger
from farhand.common.wire import keys
from farhand.common.wire.keys import Channel
from farhand.common.wire.reason_words import sentence

_log = loop_logger(__name__)

_AGAIN_S = 10.0
"""Time before a reason is told again [s]."""
_FLOOD, _FLOOD_S = 100, 5.0
"""Number of unwanted messages of one site in a time [s] that is told as a flood."""
_MOST_KEPT = 256
_PAUSE_S = 0.002
"""Shortest pause in reading a connection after an unwanted message [s]."""
_PAUSES = 9
"""Pause as a multiple of the time spent on the message: a flood gets at most a tenth of one processor."""
_OF_TRANSPORT = re.compile(r"(\x1b\[[0-9;]*m)*\d{4}-\d\d-\d\dT[\d:.]+Z")
_REASONS = (
    (r"certificate expired", "a site was refused: its certificate has expired"),
    (r"not valid yet", "a site was refused: its certificate is not valid yet; are both clocks right?"),
    (r"BadSignature|UnknownIssuer", "a site was refused: another authority has issued its certificate"),
    (r"sent no certificates|CertificateRequired", "a site was refused: it shows no certificate"),
    (r"invalid peer certificate", "a site was refused: its certificate is not accepted"),
    (r"corrupt message|InvalidContentType", "a connection was refused: it does not speak TLS, such as over tcp/"),
    (r"received fatal alert|ConnectionClosed.*crypto",
     "a site does not accept this certificate: it trusts another authority, dials another name, or its clock is wrong"),
)  # fmt: skip


class Refusals:
    """Teller of refusals, for any thread.

    Args:
        tell: Takes a refusal in words; never blocks.
        now_s: Returns the present time [s].
        slows: True to read a connection more slowly after an unwanted message; not that of a hub, which carries
            the stops of other sites, too.
    """

    def __init__(
        self, tell: Callable[[str], None], now_s: Callable[[], float] = elapsed_s, slows: bool = True
    ):
        self._tell, self._now_s, self._slows = tell, now_s, slows
        self._lock = threading.Lock()
        self._told: dict[str, tuple[float, int]] = {}  # when, and how many times since
        self._unwanted: dict[str, tuple[float, int]] = {}

    def add(self, words: str) -> None:
        """Tell a refusal, unless the same one was told a moment ago; then it is only counted."""
        with self._lock:
            if words not in self._told and len(self._told) >= _MOST_KEPT:
                self._told.clear()
            told_s, n = self._told.get(words, (-_AGAIN_S, 0))
            again = self._now_s() - told_s < _AGAIN_S
            self._told[words] = (told_s, n + 1) if again else (self._now_s(), 0)
        if not again:
            self._tell(f"{words} ({n} more like it)" if n else words)

    def guarded(
        self, channel: Channel, take: Callable[[Any], bool | None], heard: Callable[[], None]
    ) -> Callable[[Any], None]:
        """Return what takes each item of a channel within bounds, in the thread that reads its connection.

        Args:
            channel: The channel.
            take: Takes an item; returns False for an unwanted one.
            heard: Called for each item.
        """

        def hear(item: Any) -> None:
            heard()
            began_s = time.thread_time()
            who = site_in(item) if channel.is_to_robot else "the robot"
            try:
                wanted = item.payload is None or len(item.payload) <= channel.most_bytes
                if not wanted:
                    self.add(
                        f"a message of {who} was dropped: more than {channel.most_bytes} bytes on {channel.key}"
                    )
                wanted = wanted and take(item)
            except Exception:
                _log.exception("a message on %s could not be handled", channel.key)
                wanted = False
            if wanted is False:
                self.unwanted(who)
                if self._slows:
                    time.sleep(max(_PAUSE_S, _PAUSES * (time.thread_time() - began_s)))

        return hear

    def unwanted(self, site: str) -> None:
        """Count a message that was malformed, or came before the ones before it were done; a flood is told."""
        with self._lock:
            if site not in self._unwanted and len(self._unwanted) >= _MOST_KEPT:
                self._unwanted.clear()
            since_s, n = self._unwanted.get(site, (self._now_s(), 0))
            if self._now_s() - since_s > _FLOOD_S:
                since_s, n = self._now_s(), 0
            self._unwanted[site] = (since_s, n + 1)
        if n + 1 >= _FLOOD:
            then = "it is read more slowly" if self._slows else "revoke it at the hub if it goes on"
            self.add(f"{site} sends too fast, or what is not understood: {then}")

    def transport_said(self, line: str) -> bool:
        """Tell the refusal in a line of the transport's log, in our words; return False if the line has none."""
        words = next((words for pattern, words in _REASONS if re.search(pattern, line)), "")
        if words:
            self.add(words)
        return bool(words)


def serve_rights(access: AccessWatch | None, robot: str, refusals: Refusals) -> Declare:
    """Return the declaration by which a robot's end answers each site what it may do, and tells whom it refuses.

    Args:
        access: Rights of the sites; None without certificates: every site is an operator.
        robot: Name of the robot.
        refusals: Teller of the refusals.
    """

    def declare(session: zenoh.Session) -> Any:
        answers = access.answers() if access is not None else obeys_all

        def hear(query: zenoh.Query) -> None:
            answer = answers(site := site_in(query))
            if (why := explain_right(answer, site, robot)) is not None:
                refusals.add(sentence(why))
            reply_to(query, answer)

        return session.declare_queryable(keys.RIGHT.of("*"), in_reader(hear))

    return declare


@contextlib.contextmanager
def transport_refusals(tell: Callable[[str], None]) -> Iterator[None]:
    """Read the transport's log for the time of the block, and tell the refusals in it.

    Call it before the transport is used. What else is printed, as by a driver of the user's own, goes where it would
    have gone. With `RUST_LOG` set, the transport's lines also go to standard error.

    Args:
        tell: Takes a refusal in words; never blocks.
    """
    refusals, shown = Refusals(tell), "RUST_LOG" in os.environ
    reading, writing = os.pipe()
    before = os.dup(1)
    os.dup2(writing, 1)
    os.close(writing)

    def read() -> None:
        with os.fdopen(reading, encoding="utf-8", errors="replace") as lines:
            for line in lines:
                if not _OF_TRANSPORT.match(line):
                    with contextlib.suppress(OSError):
                        os.write(before, line.encode())
                elif not refusals.transport_said(line) and shown:
                    sys.stderr.write(line)

    reader = threading.Thread(target=read, name="transport log", daemon=True)
    reader.start()
    zenoh.init_log_from_env_or("warn")
    try:
        yield
    finally:
        sys.stdout.flush()
        os.dup2(before, 1)  # the last writer's end is closed: the reader ends, unless a child process has one
        reader.join(timeout=1.0)
