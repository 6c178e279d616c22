"""Optional parts of a plant and of a perception: start, close, halt, and a fault that the machine tells.

A driver has those of them that its machine needs, and inherits nothing: a part that is missing is not used.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Protocol, runtime_checkable

from farhand.common.log import loop_logger

_log = loop_logger(__name__)


@runtime_checkable
class Startable(Protocol):
    """Driver that opens its machine or sensor."""

    def start(self) -> None:
        """Open it, before the first measurement and before anybody can connect. May take seconds, and may raise."""
        ...


@runtime_checkable
class Closable(Protocol):
    """Driver that closes its machine or sensor."""

    def close(self) -> None:
        """Close it, once, after the last control period and after `halt`; not called if `start` failed."""
        ...


@runtime_checkable
class Haltable(Protocol):
    """Driver of a machine that can stop without the control loop."""

    def halt(self) -> None:
        """Stop the machine, whatever its state.

        It is called after `brake` in every control period with a fault or an error, and at the end of the process; it
        must bear repetition. After it `read` and `brake` are called as before, and must not set the machine moving:
        `accelerate` and `follow` come only once the operator has reset and armed the robot.
        """
        ...


@runtime_checkable
class Monitored(Protocol):
    """Driver of a machine that can have a fault: an emergency stop, a drive, a bus."""

    @property
    def fault(self) -> str:
        """Fault in words for the operator, empty while none; read in every control period, and must not block."""
        ...


def halts_of(*drivers: object) -> list[Callable[[], None]]:
    """Return the `halt` of each driver that has one."""
    return [driver.halt for driver in drivers if isinstance(driver, Haltable)]


def call_all(stops: Iterable[Callable[[], None]]) -> None:
    """Call each function, whatever the others raise, be it the end of the process. Never raises."""
    for stop in stops:
        try:
            stop()
        except KeyboardInterrupt:
            raise
        except BaseException:
            _log.exception("a driver could not be stopped")
