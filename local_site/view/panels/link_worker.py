"""Thread that talks to the link process, so that the page never waits for it."""

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
    """Reader and setter of the link process's state.

    Args:
        control: Control socket of the link process.
    """

    def __init__(self, control: RelayControl):
        self._control = control
        self._requests: Mailbox[Request] = Mailbox(_KEEP)
        self._closed = threading.Event()
        self.status: dict[str, Any] | None = None
        self.problem = ""
        self._thread = threading.Thread(target=self._run, name="link control", daemon=True)

    def start(self) -> None:
        """Start asking."""
        self._thread.start()

    def close(self) -> None:
        """End the thread."""
        self._closed.set()
        self._requests.put(RelayControl.status)
        self._thread.join(timeout=6.0)

    def submit(self, request: Request) -> None:
        """Have a setting changed soon. Never blocks."""
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
            # No link process: the panel stays hidden until one answers.
            self.status = None
            _log.debug("%s", error)
