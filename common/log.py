"""Logging: one line per fact, coloured on a terminal, rate-limited inside loops."""

from __future__ import annotations

import logging
import sys
import time
import warnings

_FORMAT = "%(asctime)s %(levelname)-7s %(name)s: %(message)s"


class RateLimitFilter(logging.Filter):
    """Filter that lets each line of code log once per period, and adds the number of dropped records.

    Args:
        period_s: Shortest time between two records of the same file and line [s].
    """

    def __init__(self, period_s: float = 1.0):
        super().__init__()
        self._period_s = period_s
        self._last_s: dict[tuple[str, int], float] = {}
        self._silent: dict[tuple[str, int], int] = {}

    def filter(self, record: logging.LogRecord) -> bool:
        """Decide whether a record is logged."""
        place, now_s = (record.pathname, record.lineno), time.monotonic()
        if now_s - self._last_s.get(place, -self._period_s) < self._period_s:
            self._silent[place] = self._silent.get(place, 0) + 1
            return False
        self._last_s[place] = now_s
        if silent := self._silent.pop(place, 0):
            record.msg = f"{record.msg} (and {silent} more like it)"
        return True


def loop_logger(name: str) -> logging.Logger:
    """Return a rate-limited logger for code that runs many times a second."""
    logger = logging.getLogger(name)
    if not any(isinstance(present, RateLimitFilter) for present in logger.filters):
        logger.addFilter(RateLimitFilter())
    return logger


def _one_line(
    message: Warning | str, category: type[Warning], file: str, number: int, _line: str | None = None
) -> str:
    return f"{category.__name__} in {file}:{number}: {' '.join(str(message).split())}"


def configure_logging(process: str, verbose: bool = False) -> None:
    """Send this process's log to standard error.

    Args:
        process: Name of the process, put in front of each line of a child process.
        verbose: Show debug records as well.
    """
    handler: logging.Handler
    if sys.stderr.isatty():
        from rich.console import Console
        from rich.logging import RichHandler

        handler = RichHandler(console=Console(stderr=True), show_path=False)
        handler.setFormatter(logging.Formatter(f"{process}: %(message)s"))
    else:
        handler = logging.StreamHandler()
        handler.setFormatter(logging.Formatter(_FORMAT.replace("%(name)s", process)))
    logging.basicConfig(level=logging.DEBUG if verbose else logging.INFO, handlers=[handler], force=True)
    # dm_control logs at every start which OpenGL it does not load, which reads like a failure.
    # A library's warning becomes a line of the log.
    warnings.formatwarning = _one_line
    logging.captureWarnings(True)
    logging.getLogger("absl").setLevel(logging.NOTSET if verbose else logging.WARNING)
