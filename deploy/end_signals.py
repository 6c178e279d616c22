"""SIGTERM and Ctrl-C, heard in a thread of their own."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable
from queue import SimpleQueue

END_SIGNALS = (signal.SIGINT, signal.SIGTERM)


def on_end_signal(end: Callable[[], None]) -> None:
    """Have `end` called, in a thread, at the first signal to end.

    A handler proper runs inside whatever the main thread is doing, for example inside the very lock that `end`
    needs: setting a `threading.Event` there can wait for itself for ever. Only `SimpleQueue.put` may interrupt
    anything.

    Args:
        end: May take locks; must not raise.
    """
    asked: SimpleQueue[None] = SimpleQueue()

    def wait_and_end() -> None:
        asked.get()
        end()

    threading.Thread(target=wait_and_end, name="end-signal", daemon=True).start()
    for number in END_SIGNALS:
        signal.signal(number, lambda *_: asked.put(None))
