"""Talks to the link process in a thread of its own, so that the page never waits for it."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

from farhand.common.errors import InvalidConfiguration, LinkError
from farhand.common.impairment.link_control import RelayControl
from farhand.common.log import loop_logger
from farhand.common.mailbox import Mailbox

_log = loop_logger(__name__)

_POLL_S = 1.0
_KEEP = 32

Request = Callable[[RelayControl], dict[str, Any]]


class LinkWorker:
    """Asks the link process what it does, and has it changed.

    Args:
        control: Its control socket.
    """

    def __init__(self, control: RelayControl):
        self._control = control
        self._requests: Mailbox[Request] = Mailbox(_KEEP)
        self._closed = threading.Event()
        self.status: dict[str, Any] | None = None
        self.problem = ""
        self._thread = threading.Thread(target=self._run, name="link control", daemon=True)

    def start(self) -> None:
        """Begin to ask."""
        self._thread.start()

    def close(self) -> None:
        """End the thread."""
        self._closed.set()
        self._requests.put(RelayControl.status)
        self._thread.join(timeout=6.0)

    def submit(self, request: Request) -> None:
        """Have something changed soon. Never blocks."""
        self._requests.put(request)

    def _run(self) -> None:
        while not self._closed.is_set():
            for request in self._requests.take_all() or [RelayControl.status]:
                if self._closed.is_set():
                    return
                self._do(request)
            self._requests.wait(_POLL_S)

    def _do(self, request: Request) -> None:
        try:
            self.status = request(self._control)
            self.problem = ""
        except InvalidConfiguration as error:
            self.problem = str(error)
        except LinkError as error:
            # No link process: the panel is hidden until it answers.
            self.status = None
            _log.debug("%s", error)
