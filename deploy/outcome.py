"""End of a command: the signals to end, the exit status, the reason of a failure, and the result in words."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import sys
import threading
from collections.abc import Callable
from typing import Any, Protocol

from farhand.common.errors import FarhandError, InvalidInput, on_one_line
from farhand.deploy.entry import PACKAGE

FAILED, REFUSED, INTERRUPTED, TERMINATED = 1, 2, 130, 143


class Terminated(KeyboardInterrupt):
    """SIGTERM in a command that does not handle it otherwise; it ends the command like Ctrl-C."""


class CliCommand(Protocol):
    """Command with its arguments."""

    def run(self) -> int:
        """Run the command and return its exit status."""
        ...


def status_of(command: CliCommand) -> int:
    """Run a command.

    Returns:
        The exit status: the command's own, 2 for wrong input, 130 for Ctrl-C, 143 for SIGTERM, 1 for any
        other failure.
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
        # Foreign code may raise another error at a signal, such as a library's "initialization failed".
        status = _asked_to_end[0]
        return _failed("terminated" if status == TERMINATED else "interrupted", status)


def _hear_signals() -> None:
    sys.unraisablehook = _end_when_interrupted
    _asked_to_end.clear()
    for number, handler in ((signal.SIGINT, _interrupt), (signal.SIGTERM, _terminate)):
        if signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, handler)


def _failed(why: str, status: int) -> int:
    sys.stderr.write(f"farhand: {on_one_line(why)}\n")
    return status


_asked_to_end: list[int] = []
"""Exit statuses of the received signals to end, in order."""


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


def summary(result: dict[str, Any]) -> list[str]:
    """Return the result of a job in a few lines per task."""
    return [line for task in result.get("tasks", [result]) for line in _of_task(task, result["link"])]


_JUDGED = {True: "SUCCESS", False: "FAILED", None: "DONE, NOT JUDGED"}


def _of_task(task: dict[str, Any], link: dict[str, Any]) -> list[str]:
    execution = task["execution"]
    ended = _inserted(execution) if "depth_m" in execution else _tracked(execution)
    return [
        f"task {task['task']}: {_JUDGED[task['success']]}",
        f"  learned     {task['n_components']} components, {task['n_paths']} paths from "
        f"{task['n_demonstrations']} demonstrations; {task['model_bytes']} B",
        f"  link        {link['profile']}, command round trip {link['command_round_trip_s']:.3f} s"
        + (f", cut by {link['outage']}" if link["outage"] else ""),
        f"  execution   {_arrival(execution)}, then {ended}",
    ]


def _arrival(execution: dict[str, Any]) -> str:
    after_s = execution["duration_s"]
    return f"arrived after {after_s:.2f} s" if after_s is not None else "never arrived"


def _tracked(execution: dict[str, Any]) -> str:
    rms_m, side_m = execution["rms_error_m"], execution["board_side_m"]
    if rms_m is None:
        return "at an unknown distance: only a simulation's perception knows the target's true place"
    return (
        f"{rms_m * 1e3:.1f} mm ({100 * rms_m / side_m:.2f} % of the board) RMS from the moving target over "
        f"{execution['rms_over_s']:.0f} s"
    )


def _inserted(execution: dict[str, Any]) -> str:
    peak_n, holding_n = execution["peak_force_n"], execution["holding_force_n"]
    holding = f", {holding_n:.0f} N holding it" if holding_n is not None else ""
    if execution["depth_m"] is None:
        felt = f"; {peak_n:.0f} N at most{holding}" if peak_n is not None else ""
        return f"at an unknown depth: only a simulation knows the plug's true place{felt}"
    depth_mm = execution["depth_m"] * 1e3
    where = f"{depth_mm:.1f} mm deep" if depth_mm > 0.0 else f"{-depth_mm:.1f} mm before the mouth"
    return (
        f"the plug {where}, {execution['lateral_m'] * 1e3:.1f} mm off the axis; "
        f"{peak_n:.0f} N at most{holding}"
    )


END_SIGNALS = (signal.SIGINT, signal.SIGTERM)


def on_end_signal(end: Callable[[], None]) -> None:
    """Have a thread call `end` at the first signal to end. To be called in the main thread.

    A Python signal handler interrupts the main thread anywhere, perhaps while it holds the lock that `end` needs;
    and it never runs if the main thread began an endless wait just as the signal came. So the thread is woken by
    the byte that the interpreter writes when the signal arrives.

    Args:
        end: May take locks; must not raise.
    """
    heard, written = socket.socketpair()
    written.setblocking(False)

    def wait_and_end() -> None:
        ended = False
        with heard:  # read on after the end: the interpreter complains of a byte that it cannot write
            while number := heard.recv(1):
                if number[0] in END_SIGNALS and not ended:
                    ended = True
                    end()

    threading.Thread(target=wait_and_end, name="end-signal", daemon=True).start()
    signal.set_wakeup_fd(written.detach(), warn_on_full_buffer=False)
    for number in END_SIGNALS:
        signal.signal(number, lambda *_: None)  # without a handler nothing would be written
