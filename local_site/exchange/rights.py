"""Question to the robot what this site may do, while it is not in control and hears nothing: a denial has no words."""

from __future__ import annotations

import threading
from collections.abc import Callable

from farhand.common.link.access import explain_right
from farhand.common.link.interface import Link
from farhand.common.wire import keys
from farhand.common.wire.reasons import Reason

_LOOK_S, _TIMEOUT_S, _AGAIN_S = 0.5, 5.0, 3.0


class RightsWatch:
    """Asker, in a thread of its own.

    Args:
        link: To the robot.
        site_name: Name of this site, as in its certificate.
        robot: Name of the robot.
        is_heard: Returns whether the robot serves this site as usual.
        refused: Takes the reason why it does not.
    """

    def __init__(
        self,
        link: Link,
        site_name: str,
        robot: str,
        is_heard: Callable[[], bool],
        refused: Callable[[Reason], None],
    ):
        self._link, self._site_name, self._robot = link, site_name, robot
        self._is_heard, self._refused = is_heard, refused
        self._newest: Reason | None = None
        self._answered, self._closed = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._run, name="rights", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the thread."""
        self._closed.set()
        self._answered.set()
        self._thread.join(timeout=5.0)

    def _run(self) -> None:
        while not self._closed.wait(_LOOK_S):
            if self._is_heard():
                continue
            self._answered.clear()
            self._link.ask(keys.RIGHT, b"", _TIMEOUT_S, self._take)
            self._answered.wait(_TIMEOUT_S + 1.0)
            self._closed.wait(_AGAIN_S if self._newest is not None else 0.0)

    def _take(self, answer: bytes | None) -> None:
        self._newest = explain_right(answer, self._site_name, self._robot) if answer is not None else None
        if self._newest is not None and not self._is_heard():
            self._refused(self._newest)
        self._answered.set()
