"""Mutations of every file, message and option value: each is refused in one line or accepted and right.

Never a traceback, more than 5 s, or more than 200 MB: time and memory are bounded for each mutant by itself.
"""

from __future__ import annotations

import contextlib
import io
import logging
import resource
import signal
import tempfile
import time
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from farhand.common.errors import FarhandError
from farhand.evaluation.faults import message_mutations, option_values
from farhand.evaluation.faults.mutants import Random
from farhand.evaluation.faults.subjects import SUBJECTS, WrongResult
from farhand.evaluation.metrics.tables import table

Case = dict[str, Any]

N_MUTATIONS = 100_000
LONGEST_S, MOST_MB = 5.0, 200.0
_BLOCKED_S = 60.0
_CHUNK = 1000
OPTIONS = "option values"
MESSAGES = tuple(sorted(message_mutations.kinds()))
KINDS = (*sorted(SUBJECTS), OPTIONS, *MESSAGES)
_SHOWN = 5


class Hang(BaseException):
    """A mutant took too long; no `except Exception` may take it for something else."""


def cases(trials: int | None, seed: int) -> list[Case]:
    """List chunks of mutants of every kind.

    Args:
        trials: Mutants of each kind.
        seed: Of the mutations.
    """
    n = N_MUTATIONS if trials is None else trials
    return [
        {"kind": kind, "seed": seed, "first": first, "n": min(_CHUNK, n - first)}
        for first in range(0, n, _CHUNK)
        for kind in KINDS
    ]


def trial(case: Case) -> Case:
    """Give a chunk of mutants to the product, one after the other."""
    logging.disable(logging.CRITICAL)
    counts, findings, slowest_s = Counter[str](), [], 0.0
    with _folder() as folder, warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", ResourceWarning)
        attempt = _attempt_of(case["kind"], folder)
        for number in range(case["first"], case["first"] + case["n"]):
            outcome, took_s = bounded(lambda k=number: attempt(np.random.default_rng((case["seed"], k))))
            kind, _, _ = outcome.partition(": ")
            counts[kind] += 1
            slowest_s = max(slowest_s, took_s)
            if kind not in ("accepted", "refused"):
                findings.append({"number": number, "outcome": outcome[:500]})
    logging.disable(logging.NOTSET)
    return {**case, "counts": dict(counts), "findings": findings, "slowest_s": slowest_s}


def _attempt_of(kind: str, folder: Path) -> Callable[[Random], bool]:
    """What is done with one mutant."""
    if kind == OPTIONS:
        return option_values.attempts(folder)
    if kind in MESSAGES:
        return message_mutations.attempts(kind)
    subject = SUBJECTS[kind]
    seeds = subject.seeds()

    file = folder / subject.file

    def attempt(random: Random) -> bool:
        file.write_bytes(subject.mutate(random, seeds[int(random.integers(0, len(seeds)))]))
        return subject.use(file)

    for seed in seeds:  # what is compiled and imported the first time is nobody's fault
        file.write_bytes(seed)
        if not subject.use(file):
            raise WrongResult(f"a sound file is refused: {kind}")
    return attempt


def bounded(attempt: Callable[[], bool]) -> tuple[str, float]:
    """Run an attempt within its bounds.

    Returns:
        `accepted`, `refused`, or what went wrong and how; and the time that it worked [s].
    """
    before_mb, began_s = _peak_mb(), time.process_time()
    signal.signal(signal.SIGPROF, _hang)
    signal.signal(signal.SIGALRM, _hang)
    signal.setitimer(signal.ITIMER_PROF, LONGEST_S)  # time of work: others may have the machine
    signal.setitimer(signal.ITIMER_REAL, _BLOCKED_S)
    try:
        outcome = "accepted" if attempt() else "refused"
    except FarhandError as error:
        outcome = "refused" if "\n" not in str(error) else f"several lines: {error}"
    except WrongResult as error:
        outcome = f"wrong: {error}"
    except Hang:
        outcome = "hang: longer than the bound"
    except Exception as error:
        outcome = f"traceback: {type(error).__name__}: {error} ({_where(error)})"
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.setitimer(signal.ITIMER_REAL, 0.0)
    if (grown_mb := _peak_mb() - before_mb) > MOST_MB:
        outcome = f"memory: {grown_mb:.0f} MB more"
    return outcome, time.process_time() - began_s


def _where(error: BaseException) -> str:
    """The innermost line of the project's own code."""
    found, trace = "", error.__traceback__
    while trace is not None:
        file = Path(trace.tb_frame.f_code.co_filename)
        if "site-packages" not in file.parts and file.suffix == ".py":
            found = f"{file.name}:{trace.tb_lineno}"
        trace = trace.tb_next
    return found


def _hang(*_: object) -> None:
    raise Hang


def _peak_mb() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


@contextlib.contextmanager
def _folder() -> Iterator[Path]:
    """A folder in memory where there is one: whole files are synchronised with the disk."""
    memory = Path("/dev/shm")
    with (
        tempfile.TemporaryDirectory(dir=memory if memory.is_dir() else None) as folder,
        contextlib.redirect_stderr(io.StringIO()),
    ):
        yield Path(folder)


def summarise(results: list[Case]) -> tuple[Case, str]:
    """Summarise the counts of every kind, and list what was found."""
    kinds = sorted({result["kind"] for result in results})
    summary: Case = {kind: _of_kind([r for r in results if r["kind"] == kind]) for kind in kinds}
    header = ["kind", "mutants", "refused", "accepted", "found", "slowest"]
    rows = [
        [kind, s["n"], s["refused"], s["accepted"], s["found"], f"{s['slowest_s']:.2f} s"]
        for kind, s in summary.items()
    ]
    found = [f"{r['kind']} {f['number']}: {f['outcome']}" for r in results for f in r["findings"]]
    summary["found"] = len(found)
    lines = [
        "# Mutations",
        "Sound files, messages and option values, each changed at random (bytes, fields, numbers, shapes, types, claims of"
        " headers), given to the shipped code. Each mutant must be refused in one line that names it, or be accepted"
        f" and right: no traceback, no more than {LONGEST_S:g} s of work, no more than {MOST_MB:g} MB more.",
        table(header, rows),
        f"Found: {len(found)}."
        if not found
        else "Found:\n\n" + "\n".join(f"- {line}" for line in found[:200]),
    ]
    return summary, "\n\n".join(lines)


def _of_kind(results: list[Case]) -> Case:
    counts = sum((Counter(result["counts"]) for result in results), Counter[str]())
    return {
        "n": counts.total(),
        "refused": counts["refused"],
        "accepted": counts["accepted"],
        "found": counts.total() - counts["refused"] - counts["accepted"],
        "slowest_s": max(result["slowest_s"] for result in results),
    }
