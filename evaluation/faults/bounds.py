"""One attempt within its bounds of time and memory, and many of them in a process that one of them may end."""

from __future__ import annotations

import contextlib
import json
import os
import resource
import select
import signal
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import BinaryIO, NamedTuple

from farhand.common.errors import FarhandError
from farhand.common.parent_process import end_with_parent

LONGEST_S, MOST_MB = 5.0, 200.0
_BLOCKED_S = 60.0
"""An attempt that does not work and does not come back either [s]."""
_GIVEN_UP_S = 2.0 * _BLOCKED_S
"""Foreign code that no signal reaches is killed after this time [s]."""


class WrongResult(Exception):
    """Something was accepted that is not right, or refused in more than a line."""


class Hang(BaseException):
    """An attempt took too long; no `except Exception` may take it for something else."""


class AttemptOutcome(NamedTuple):
    """Outcome of an attempt.

    Args:
        number: Of the attempt.
        words: `accepted`, `refused`, or what went wrong and how.
        took_s: How long it worked [s].
    """

    number: int
    words: str
    took_s: float


def bounded(attempt: Callable[[], bool]) -> tuple[str, float]:
    """Run an attempt within its bounds.

    Returns:
        `accepted`, `refused`, or what went wrong and how; and the time that it worked [s].
    """
    before_mb, began_s = peak_mb(), time.process_time()
    signal.signal(signal.SIGPROF, _hang)
    signal.signal(signal.SIGALRM, _hang)
    signal.setitimer(signal.ITIMER_PROF, LONGEST_S)  # time of work: others may have the machine
    signal.setitimer(signal.ITIMER_REAL, _BLOCKED_S)
    try:
        words = "accepted" if attempt() else "refused"
    except FarhandError as error:
        words = "refused" if "\n" not in str(error) else f"several lines: {error}"
    except WrongResult as error:
        words = f"wrong: {error}"
    except Hang:
        words = "hang: longer than the bound"
    except Exception as error:
        words = f"traceback: {type(error).__name__}: {error} ({_where(error)})"
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.setitimer(signal.ITIMER_REAL, 0.0)
    if (grown_mb := peak_mb() - before_mb) > MOST_MB:
        words = f"memory: {grown_mb:.0f} MB more"
    return words, time.process_time() - began_s


def guarded(
    attempts: Callable[[range], Iterator[AttemptOutcome]], numbers: range
) -> Iterator[AttemptOutcome]:
    """Run attempts in a process of their own; one that ends it is an outcome, and the next ones go on in another.

    Each process begins with the memory of this one, so that no attempt hides behind the peak of an earlier one's.

    Args:
        attempts: Runs the attempts of these numbers, in order.
        numbers: All that are wanted.
    """
    first = numbers.start
    while first < numbers.stop:
        read_fd, write_fd = os.pipe()
        parent_pid = os.getpid()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # of threads: the child needs none of them
            pid = os.fork()
        if not pid:
            os.close(read_fd)
            end_with_parent(parent_pid)
            _be_the_child(attempts(range(first, numbers.stop)), write_fd)
        os.close(write_fd)
        with os.fdopen(read_fd, "rb", buffering=0) as pipe:
            for outcome in _outcomes(pipe):
                yield outcome
                first = outcome.number + 1
        how = _end_of(pid)
        if first < numbers.stop:
            yield AttemptOutcome(first, how, 0.0)
            first += 1


def _be_the_child(outcomes: Iterator[AttemptOutcome], fd: int) -> None:
    try:
        for outcome in outcomes:
            os.write(fd, json.dumps(outcome._replace(words=outcome.words[:500])).encode() + b"\n")
        os._exit(0)
    except BaseException as error:
        with contextlib.suppress(OSError):
            os.write(2, f"{type(error).__name__}: {error}\n".encode())
    finally:
        os._exit(1)


def _outcomes(pipe: BinaryIO) -> Iterator[AttemptOutcome]:
    """Read outcomes until the process ends, or nothing comes for too long."""
    rest = b""
    while select.select([pipe], [], [], _GIVEN_UP_S)[0] and (part := pipe.read(1 << 16)):
        *lines, rest = (rest + part).split(b"\n")
        for line in lines:
            yield AttemptOutcome(*json.loads(line))


def _end_of(pid: int) -> str:
    """Wait for a process, which is killed unless it has ended, and say how it did."""
    ended, status = os.waitpid(pid, os.WNOHANG)
    if not ended and not select.select([fd := os.pidfd_open(pid)], [], [], 1.0)[0]:
        os.kill(pid, signal.SIGKILL)
        os.waitpid(pid, 0)
        os.close(fd)
        return "hang: in foreign code, which no signal reaches"
    if not ended:
        _, status = os.waitpid(pid, 0)
    if os.WIFSIGNALED(status):
        return f"ended: by signal {signal.Signals(os.WTERMSIG(status)).name}"
    return f"ended: with status {os.waitstatus_to_exitcode(status)}"


def peak_mb() -> float:
    """Return the most memory that this process has had so far [MB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def _where(error: BaseException) -> str:
    """Return the innermost line of the project's own code."""
    found, trace = "", error.__traceback__
    while trace is not None:
        file = Path(trace.tb_frame.f_code.co_filename)
        if "site-packages" not in file.parts and file.suffix == ".py":
            found = f"{file.name}:{trace.tb_lineno}"
        trace = trace.tb_next
    return found


def _hang(*_: object) -> None:
    raise Hang
