"""SIGTERM and Ctrl-C, heard in a thread of their own."""

from __future__ import annotations

import signal
import socket
import threading
from collections.abc import Callable

END_SIGNALS = (signal.SIGINT, signal.SIGTERM)


def on_end_signal(end: Callable[[], None]) -> None:
    """Have `end` called, in a thread, at the first signal to end. To be called in the main thread.

    A handler of Python's runs inside whatever the main thread is doing, for example inside the very lock that
    `end` needs; and where that thread waits for ever, having begun to wait as the signal came, it never runs.
    So what wakes the thread is the byte that the interpreter writes as the signal arrives.

    Args:
        end: May take locks; must not raise.
    """
    heard, written = socket.socketpair()
    written.setblocking(False)

    def wait_and_end() -> None:
        ended = False
        with heard:  # read on after the end: the interpreter complains of a byte that it cannot write
            while number := heard.recv(1):
                if number[0] in END_SIGNALS and not ended:
                    ended = True
                    end()

    threading.Thread(target=wait_and_end, name="end-signal", daemon=True).start()
    signal.set_wakeup_fd(written.detach(), warn_on_full_buffer=False)
    for number in END_SIGNALS:
        signal.signal(number, lambda *_: None)  # without a handler nothing would be written
