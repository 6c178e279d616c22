"""Transport session that can be reopened in place, with all declarations made on it.

Zenoh reads certificates and rights only when a session opens, and an attempt to connect that began during an outage
has backed off. A new session takes milliseconds, and the robot's boot and execution continue meanwhile.
"""

from __future__ import annotations

import contextlib
import json
import os
import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Iterator
from typing import Any

import zenoh

from farhand.common.address import listening_fault
from farhand.common.errors import LinkError, PortTaken
from farhand.common.link.endpoint import EndpointSettings, zenoh_configuration
from farhand.common.log import loop_logger
from farhand.common.wire import keys

_log = loop_logger(__name__)

RETRY_S = 0.2
_MOST_PUBLISHERS = 128
_TOKENS_S = 5.0
_PORT_FREE_S, _GOODBYE_S = 15.0, 0.5
"""Longest wait for a session's end: of one that listens, whose port is needed again, and of one that connects [s]."""
_SAID_EVERY_S = 10.0
_LINGER_S = 2.0
"""Time that a session stays after its successor took over, so that its questions are still answered [s]."""
_CLOSING = "closing a session"
_RUNTIME, _environment = "ZENOH_RUNTIME", threading.Lock()

Declare = Callable[[zenoh.Session], Any]
"""Function that declares a subscriber or a queryable with a callback, and returns it."""
Configure = Callable[[EndpointSettings], dict[str, Any]]


class Session:
    """One session of the transport at a time.

    Args:
        settings: The endpoints.
        configure: Returns the transport's configuration, with the files as they are at each opening; that of a site when not given.

    Raises:
        LinkError: When the endpoint cannot be listened on or is not understood.
    """

    def __init__(self, settings: EndpointSettings, configure: Configure | None = None):
        self._settings, self._configure = settings, configure or zenoh_configuration
        self._changed, self._swapping = threading.Condition(), threading.RLock()
        self._closed = False
        self._session = _opened(settings, self._configure)
        self._declarations: list[Declare] = []
        self._declared: list[Any] = []
        self._publishers: OrderedDict[object, zenoh.Publisher] = OrderedDict()
        self._leaving: list[threading.Thread] = []
        self.reopened = self.renewed = 0
        """Number of reopenings, and of successors that took over."""

    def declare(self, declare: Declare) -> None:
        """Make a declaration on this session and on each later one.

        Args:
            declare: Makes the declaration.
        """
        with self._swapping:
            self._declarations.append(declare)
            self._declared.append(declare(self._session))

    def publisher(self, name: object, declare: Callable[[zenoh.Session], zenoh.Publisher]) -> zenoh.Publisher:
        """Return the publisher of a name on the present session; declare it if it is new.

        Args:
            name: Key of the publisher, used by one thread alone.
            declare: Declares the publisher.
        """
        with self._changed:
            session, known = self._session, self._publishers.get(name)
        if known is None:
            known = declare(session)  # outside of the lock: it may wait for the network
            with self._changed:
                if session is self._session:
                    self._publishers[name] = known
                    if len(self._publishers) > _MOST_PUBLISHERS:
                        self._publishers.popitem(last=False)
        return known

    def get(self, *args: Any, **options: Any) -> None:
        """Ask a question, see `zenoh.Session.get`."""
        self._session.get(*args, **options)

    def answers(self, key: str, timeout_s: float, gives_up: Callable[[], bool] = lambda: False) -> bool:
        """Decide whether a question is answered in time: it is the only proof that the other end is still there.

        Args:
            key: Key of the question.
            timeout_s: Time limit of the answer [s].
            gives_up: Decides whether to end the wait early; asked again and again.
        """
        return _answers(self._session, key, timeout_s, gives_up)

    def locators(self) -> list[str]:
        """Return the locators of the connected peers."""
        with contextlib.suppress(zenoh.ZError):  # it is being closed
            return [link.dst for link in self._session.info.links()]
        return []

    def peers(self) -> list[str]:
        """Return the names in the certificates of the connected peers; their addresses without certificates."""
        with contextlib.suppress(zenoh.ZError):  # it is being closed
            return [link.auth_identifier or link.dst for link in self._session.info.links()]
        return []

    def robots(self) -> tuple[str, ...]:
        """Return the names of the robots at the hub. Asked each time: a router's own session is told of no changes."""
        with contextlib.suppress(zenoh.ZError):  # it is being closed
            tokens = self._session.liveliness().get(f"*/{keys.ALIVE}", timeout=_TOKENS_S)
            found = {str(token.ok.key_expr).partition("/")[0] for token in tokens if token.ok is not None}
            return tuple(sorted(found))
        return ()

    def reopen(self) -> None:
        """Close the session and open it with the present files; in between nothing is sent or received."""
        with self._swapping:
            if self._closed:
                return
            self._end()
            session = self._until_opened()
            with self._changed:
                self._session, self._publishers = session, OrderedDict()
                self.reopened += 1
            if not self._closed:
                self._declared = [declare(session) for declare in self._declarations]

    def renew(self, key: str, timeout_s: float, gives_up: Callable[[], bool]) -> None:
        """Open another session beside the present one, which takes over once the other end has answered on it.

        Without an answer in time the present one stays. Until the change both receive: what must not be handled twice needs an id.

        Args:
            key: Key of a question that the other end answers.
            timeout_s: Time limit of the answer [s].
            gives_up: Decides whether to end the attempt early; asked again and again.
        """
        with self._swapping:
            if self._closed:
                return
            try:
                successor = _opened(self._settings, self._configure, waits=False)
            except LinkError as error:  # such as certificates that are being replaced
                _log.info("the link keeps its connection: %s", error)
                return
            declared = [declare(successor) for declare in self._declarations]
            if _answers(successor, key, timeout_s, gives_up):
                with self._changed:
                    present = self._session, self._declared
                    self._session, self._declared, self._publishers = successor, declared, OrderedDict()
                    self.renewed += 1
                successor, declared = present
            leaving = _closing_thread(self._leave, successor, declared)
            self._leaving = [*(each for each in self._leaving if each.is_alive()), leaving]
            leaving.start()

    def _leave(self, session: zenoh.Session, declared: list[Any]) -> None:
        """Close a session that is not needed, after its last answers; that blocks for seconds if it is not connected."""
        for each in declared:
            with contextlib.suppress(zenoh.ZError):
                each.undeclare()
        with self._changed:
            self._changed.wait_for(lambda: self._closed, _LINGER_S)
        _close(session)

    def close(self) -> None:
        """Close the session; a second call does nothing. Without it the interpreter would hang at its exit."""
        with self._changed:
            if self._closed:
                return
            self._closed = True
            self._changed.notify_all()
        with self._swapping:
            self._end()
        for leaving in self._leaving:
            leaving.join(_GOODBYE_S)

    def _end(self) -> None:
        """Close the present session, in the background if its attempt to connect is under way: that blocks for seconds."""
        closing = _closing_thread(_close, self._session)
        closing.start()
        closing.join(_PORT_FREE_S if self._settings.listen else _GOODBYE_S)

    def _until_opened(self) -> zenoh.Session:
        """Retry to open the session: another process may have the port for a moment."""
        said_s = -_SAID_EVERY_S
        while True:
            try:
                return _opened(self._settings, self._configure, waits=False)
            except LinkError as error:
                if self._closed:
                    return self._session
                if time.monotonic() - said_s >= _SAID_EVERY_S:
                    said_s = time.monotonic()
                    _log.warning("the link cannot be opened again yet: %s", error)
                with self._changed:
                    self._changed.wait(RETRY_S)


def are_closing() -> bool:
    """Return whether sessions are being closed, for which the interpreter would wait at its end."""
    return any(thread.name == _CLOSING for thread in threading.enumerate())


def _closing_thread(close: Callable[..., None], *arguments: object) -> threading.Thread:
    # No daemon: the interpreter's end would stop it in the middle of the transport's own code, and abort.
    return threading.Thread(target=close, args=arguments, name=_CLOSING)


def _close(session: zenoh.Session) -> None:
    with contextlib.suppress(zenoh.ZError):  # the attempt outlasted the transport's patience
        session.close()


def _answers(session: zenoh.Session, key: str, timeout_s: float, gives_up: Callable[[], bool]) -> bool:
    """Decide whether a question is answered in time on a session."""
    until_s, answered, asks = time.monotonic() + timeout_s, threading.Event(), threading.Event()

    def hear(reply: zenoh.Reply) -> None:
        if reply.ok is not None:
            answered.set()

    asks.set()
    while (left_s := until_s - time.monotonic()) > 0 and not gives_up():
        if asks.is_set():  # an unconnected question ends at once
            asks.clear()
            handler = zenoh.handlers.Callback(hear, asks.set, indirect=False)
            with contextlib.suppress(zenoh.ZError):  # it is being closed
                session.get(key, handler, timeout=left_s, express=True)
        if answered.wait(min(left_s, RETRY_S)):
            break
    return answered.is_set()


def _opened(settings: EndpointSettings, configure: Configure, waits: bool = True) -> zenoh.Session:
    """Open a session; with `waits` half a second passes if it is not connected before.

    Raises:
        LinkError: When the endpoint cannot be listened on or is not understood.
    """
    configuration = configure(settings)
    configuration["scouting"] |= {} if waits else {"delay": 0}
    try:
        with _readers(configuration["transport"]["unicast"]["max_sessions"] + 1):
            return zenoh.open(zenoh.Config.from_json5(json.dumps(configuration)))
    except zenoh.ZError as error:
        where = settings.endpoint
        first_line = str(error).split(" at /")[0].splitlines()[0][:200]
        why = listening_fault(settings.listen) if settings.listen else ""
        kind = PortTaken if "is in use" in why else LinkError
        raise kind(f"{where}: {why or f'cannot be opened ({first_line})'}") from error


@contextlib.contextmanager
def _readers(n: int) -> Iterator[None]:
    """Have the transport begin with this many readers, if it begins in this block; child processes do not inherit it.

    With one for each connection, one that is slow, paused or waits for room at another connection holds up no other.
    With fewer, all can wait for a connection that is being closed, for ever (eclipse-zenoh/zenoh, issue 1876).
    """
    with _environment, contextlib.ExitStack() as ended:
        if _RUNTIME not in os.environ:  # else it is the user's own
            os.environ[_RUNTIME] = f"(rx: (worker_threads: {n}))"
            ended.callback(os.environ.pop, _RUNTIME)
        yield
