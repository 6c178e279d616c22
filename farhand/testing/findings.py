"""Findings of the checks of drivers: collected, and raised as one AssertionError; a driver is opened for its checks."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from farhand.common.errors import InvalidInput
from farhand.remote_site.interface.driver import Closable, Haltable, Monitored, Startable


@contextmanager
def findings(what: str) -> Iterator[list[str]]:
    """Collect findings, and raise them together at the end.

    Args:
        what: Kind of driver, before each line.

    Raises:
        AssertionError: With a line for each finding, and for what was raised.
    """
    told: list[str] = []
    try:
        yield told
    except Exception as error:
        told.append(str(error) if isinstance(error, InvalidInput) else f"{type(error).__name__}: {error}")
    if told:
        raise AssertionError("\n".join(f"{what}: {line.removeprefix(f'{what}: ')}" for line in told))


@contextmanager
def opened(driver: object, told: list[str], *methods: str) -> Iterator[None]:
    """Start a driver, and halt and close it at the end, as far as it can be.

    Args:
        driver: Driver that has not been started.
        told: Findings.
        methods: Methods that it must have.

    Raises:
        InvalidInput: When it lacks one.
    """
    if missing := ", ".join(name for name in methods if not callable(getattr(driver, name, None))):
        raise InvalidInput(type(driver).__name__, "", f"it has no {missing}")
    if isinstance(driver, Startable):
        driver.start()
    try:
        if isinstance(driver, Monitored) and driver.fault != "":
            told.append(f"fault: an empty text while it has none, got {driver.fault!r}")
        yield
    finally:
        for name, part in (("halt", Haltable), ("close", Closable)):
            if isinstance(driver, part):
                getattr(driver, name)()


def check_times(told: list[str], durations_s: list[float], dt_s: float) -> None:
    """Tell if even the fastest period takes half of the control period."""
    fastest_s = min(durations_s, default=0.0)  # the machine may be busy now and then
    if fastest_s > 0.5 * dt_s:
        told.append(
            f"a period takes {fastest_s * 1e3:.1f} ms at least: wait for a bus in a thread of your own"
        )
