"""End of a command: its exit status, and one line with the reason of a failure."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
from typing import Protocol

from farhand.common.errors import FarhandError, InvalidInput
from farhand.deploy.entry import PACKAGE

FAILED, REFUSED, INTERRUPTED, TERMINATED = 1, 2, 130, 143


class Terminated(KeyboardInterrupt):
    """SIGTERM, where nothing else waits for it: ends the work as Ctrl-C does."""


class CliCommand(Protocol):
    """A command with its arguments."""

    def run(self) -> int:
        """Do it, and return the exit status."""
        ...


def status_of(command: CliCommand) -> int:
    """Run a command.

    Returns:
        The exit status: the command's own, 2 for input that is wrong, 130 for Ctrl-C, 143 for SIGTERM, 1 for
        what else failed.
    """
    _hear_signals()
    try:
        return command.run()
    except Terminated:
        return _failed("terminated", TERMINATED)
    except KeyboardInterrupt:
        return _failed("interrupted", INTERRUPTED)
    except FarhandError as error:
        return _failed(str(error), REFUSED if isinstance(error, InvalidInput) else FAILED)
    except OSError as error:
        return _failed(f"{error.filename or 'the system'}: {error.strerror or error}", FAILED)
    except ModuleNotFoundError as error:
        package = (error.name or "").partition(".")[0]
        if package == PACKAGE:
            raise
        return _failed(
            f"{package} is not installed: pip install 'farhand[evaluation]' brings it along", FAILED
        )
    except Exception:
        if not _asked_to_end:
            raise
        # Foreign code makes something else of a signal, such as a library whose "initialization failed".
        status = _asked_to_end[0]
        return _failed("terminated" if status == TERMINATED else "interrupted", status)


def _hear_signals() -> None:
    sys.unraisablehook = _end_when_interrupted
    _asked_to_end.clear()
    for number, handler in ((signal.SIGINT, _interrupt), (signal.SIGTERM, _terminate)):
        if signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, handler)


def _on_one_line(text: str) -> str:
    """Escape the line feeds and other control characters of a name that an error quotes."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def _failed(why: str, status: int) -> int:
    sys.stderr.write(f"farhand: {_on_one_line(why)}\n")
    return status


_asked_to_end: list[int] = []
"""Exit statuses of the signals to end that came, in order."""


def _interrupt(*_: object) -> None:
    _asked_to_end.append(INTERRUPTED)
    raise KeyboardInterrupt


def _terminate(*_: object) -> None:
    _asked_to_end.append(TERMINATED)
    raise Terminated


def _end_when_interrupted(unraisable: sys.UnraisableHookArgs) -> None:
    """End the process where Ctrl-C came inside what cannot raise (a finalizer, a callback from C)."""
    if isinstance(unraisable.exc_value, KeyboardInterrupt):
        with contextlib.suppress(OSError):
            os.write(2, b"farhand: interrupted\n")
        os._exit(INTERRUPTED)
    sys.__unraisablehook__(unraisable)
