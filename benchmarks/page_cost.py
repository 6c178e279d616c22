"""Cost of the operator's page: `.venv/bin/python -m benchmarks.page_cost [start] [board] [arm]`.

Prints how soon a page answers and shows the robot's mode after `farhand up --link geo` (this needs a
Chromium); how much of a core the local site needs, how much of that without any client, and what it sends to
one client, while nothing moves and while the robot moves, for an arm also while a preview plays and with the
robot's camera; and how soon a press is shown as pending. All of these without an argument.
"""

from __future__ import annotations

import os
import statistics
import sys
import tempfile
import time
import urllib.error
import urllib.request
from pathlib import Path

from playwright.sync_api import sync_playwright

from farhand.common.address import free_port
from farhand.evaluation.harness.farhand_process import HeardProcess
from tests.browser.arm_page import ArmPage
from tests.browser.operator_page import OperatorPage, launch
from tests.browser.raw_client import RawClient, raw_connection
from tests.browser.stack import Stack, farhand_up, still_task
from tests.farhand_process import running

_MEASURED_S = 15.0
_PATIENCE_S = 120.0
_SLOWLY_PERCENT = 20.0
_PRESSES = 5
_READY = (("Load samples", "robot lacks it"), ("Send model", "robot has it"), ("Arm", "HOLD"))


def main() -> int:
    """Measure and print all, or the named parts: start, board, arm.

    Returns:
        The exit status: 0.
    """
    measures = {"start": measure_start, "board": measure_board, "arm": measure_arm}
    say(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")
    for name in sys.argv[1:] or measures:
        with tempfile.TemporaryDirectory() as scratch:
            measures[name](Path(scratch))
    return 0


def measure_start(folder: Path) -> None:
    """Measure the time from the command to the first answer and to the mode in a browser."""
    kinds: dict[str, type[OperatorPage]] = {"planar": OperatorPage, "hot-stab": ArmPage}
    with sync_playwright() as playwright:
        browser = launch(playwright)
        for task, kind in kinds.items():
            port = free_port()
            address = f"http://127.0.0.1:{port}"
            page = kind(browser.new_page())
            began_s = time.monotonic()
            options = (f"--task={task}", "--link=geo", f"--port={port}", f"--data-dir={folder / task}")
            with running("up", *options) as process:
                await_answer(address, process)
                answered_s = time.monotonic() - began_s
                page.goto(address)
                seen_s = time.monotonic() - began_s
                page.settle()
                drawn_s = time.monotonic() - began_s
            say(
                f"{task + ':':16} HTTP answers after {answered_s:5.2f} s, the mode is shown after {seen_s:5.2f} s "
                f"(at most 10), all is drawn after {drawn_s:5.2f} s"
            )
        browser.close()


def await_answer(address: str, process: HeardProcess) -> None:
    """Ask until it answers."""
    while process.running:
        try:
            urllib.request.urlopen(address, timeout=5.0).close()
            return
        except urllib.error.URLError:
            os.sched_yield()
    raise RuntimeError(process.words)


def measure_board(folder: Path) -> None:
    """Measure the planar page while its U stands still, and while the robot tracks the swinging one."""
    with (
        farhand_up(folder / "still", link="geo", task=still_task(folder)) as stack,
        raw_connection(stack.address) as connection,
    ):
        client = RawClient(connection)
        until(client, "DISARMED")
        report("nothing moves", stack, client)
    with farhand_up(folder / "moving", link="geo") as stack, raw_connection(stack.address) as connection:
        client = RawClient(connection)
        for button, shown in (*_READY, ("Execute", "ARRIVED")):
            client.press(button)
            until(client, shown)
        report("the robot moves", stack, client)


def measure_arm(folder: Path) -> None:
    """Measure the arm's page while no arm moves, and while the robot's moves slowly; without the camera and with it."""
    with farhand_up(folder / "arm", link="geo", task="hot-stab") as stack:
        pid = stack.process.children()["local"]
        before_s = processor_s(pid)
        time.sleep(_MEASURED_S)
        say(
            f"{'no client:':22} local site {100 * (processor_s(pid) - before_s) / _MEASURED_S:5.1f} % of a core"
        )
        with raw_connection(stack.address) as connection:
            _measure_client(stack, RawClient(connection))


def _measure_client(stack: Stack, client: RawClient) -> None:
    until(client, "DISARMED")
    report("no arm moves, camera", stack, client)
    client.press("Camera")
    report("no arm moves", stack, client)
    for button, shown in _READY:
        client.press(button)
        until(client, shown)
    say_pending(client)
    client.set("Speed [%]", value=_SLOWLY_PERCENT)
    until(client, f"at {_SLOWLY_PERCENT:.0f}%")
    client.press("Preview")
    until(client, "of motion")
    report("a preview", stack, client)
    client.press("Preview")
    until(client, "of motion")
    client.press("Execute")
    until(client, "APPROACHING")
    report("an arm moves", stack, client)
    client.press("Camera")
    report("an arm moves, camera", stack, client)


def say_pending(client: RawClient) -> None:
    """Measure the time from a press to its mark as pending, and to the mode that it leads to, as a client is sent them."""
    marked_s, done_s = [], []
    for _ in range(_PRESSES):
        for label, mode in (("Disarm", "DISARMED"), ("Arm", "HOLD")):
            began_s = time.monotonic()
            client.press(label)
            until(client, "yellow")
            marked_s.append(time.monotonic() - began_s)
            until(client, f">{mode}</span>")
            done_s.append(time.monotonic() - began_s)
    say(
        f"{'a press:':22} pending after {1e3 * statistics.median(marked_s):.0f} ms (largest {1e3 * max(marked_s):.0f}; "
        f"at most 100), done after {1e3 * statistics.median(done_s):.0f} ms"
    )


def until(client: RawClient, words: str) -> None:
    """Wait until the page says something.

    Raises:
        TimeoutError: On a time-out.
    """
    if not client.shows(words, _PATIENCE_S):
        raise TimeoutError(f"the page did not say {words!r} within {_PATIENCE_S:g} s")


def report(what: str, stack: Stack, client: RawClient) -> None:
    """Measure the local site's processor time and one client's traffic over some seconds."""
    pid = stack.process.children()["local"]
    before_s, n_bytes, n_messages = processor_s(pid), client.n_bytes, 0
    began_s = time.monotonic()
    while (left_s := began_s + _MEASURED_S - time.monotonic()) > 0.0:
        try:
            n_messages += len(client.receive(left_s))
        except TimeoutError:
            break
    took_s = time.monotonic() - began_s
    say(
        f"{what + ':':22} local site {100 * (processor_s(pid) - before_s) / took_s:5.1f} % of a core, "
        f"{n_messages / took_s:6.1f} messages/s, {(client.n_bytes - n_bytes) / took_s * 1e-3:6.1f} kB/s"
    )


def processor_s(pid: int) -> float:
    """Return the processor time of a process so far [s]."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def say(line: str) -> None:
    """Print a line."""
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
