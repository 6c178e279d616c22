"""A study whose trials say in which process they run and then wait for ever, for the tests of the runner.

Run as a program, it is an `evaluate` of it.
"""

from __future__ import annotations

import os
import signal
import sys
from typing import Any

from farhand.evaluation import study

Case = dict[str, Any]


def cases(trials: int | None, seed: int) -> list[Case]:
    return [{}] * (trials or 1)


def trial(case: Case) -> Case:
    sys.stdout.write(f"{os.getpid()}\n")
    sys.stdout.flush()
    signal.pause()
    return case


def summarise(results: list[Case]) -> tuple[Case, str]:
    return {}, "# Waiting"


if __name__ == "__main__":
    # A shell ignores it for what it runs in the background, and so would this process.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    study.STUDIES["waiting"] = "tests.evaluation.waiting"
    study.run("waiting", 1, 0, sys.argv[1], "")
