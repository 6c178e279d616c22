"""Mutations of every file, message and option value: each is refused in one line or accepted and right.

Never a traceback, more than 5 s, or more than 200 MB: time and memory are bounded for each mutant separately.
"""

from __future__ import annotations

import contextlib
import io
import logging
import tempfile
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from farhand.evaluation.faults import message_mutations, option_values
from farhand.evaluation.faults.bounds import LONGEST_S, MOST_MB, AttemptOutcome, WrongResult, bounded, guarded
from farhand.evaluation.faults.mutants import Random
from farhand.evaluation.faults.subjects import SUBJECTS, WHOLE
from farhand.evaluation.metrics.tables import table

Case = dict[str, Any]

GOES_ON = True
N_MUTATIONS = 100_000
_CHUNK = 10_000
OPTIONS = "option values"
MESSAGES = tuple(sorted(message_mutations.kinds()))
KINDS = (*sorted(SUBJECTS), OPTIONS, *MESSAGES)
_SHOWN = 5


def cases(trials: int | None, seed: int) -> list[Case]:
    """List chunks of mutants of every kind.

    Args:
        trials: Mutants of each kind.
        seed: Of the mutations.
    """
    n = N_MUTATIONS if trials is None else trials
    return [
        {"kind": kind, "seed": seed, "first": first, "n": min(_CHUNK, n - first)}
        for kind in KINDS
        for first in range(0, n, _CHUNK)
    ]


def trial(case: Case) -> Case:
    """Give a chunk of mutants to the product, one after the other, in a process that a mutant may end."""
    counts, findings, slowest_s = Counter[str](), [], 0.0
    logging.disable(logging.CRITICAL)
    with _folder() as folder, warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", ResourceWarning)
        attempt = _attempt_of(case["kind"], folder)
        numbers = range(case["first"], case["first"] + case["n"])
        for outcome in guarded(partial(_outcomes, attempt, case["seed"]), numbers):
            kind, _, _ = outcome.words.partition(": ")
            counts[kind] += 1
            slowest_s = max(slowest_s, outcome.took_s)
            if kind not in ("accepted", "refused"):
                findings.append({"number": outcome.number, "outcome": outcome.words})
    logging.disable(logging.NOTSET)
    return {**case, "counts": dict(counts), "findings": findings, "slowest_s": slowest_s}


def _outcomes(attempt: Callable[[Random], bool], seed: int, numbers: range) -> Iterator[AttemptOutcome]:
    for number in numbers:
        yield AttemptOutcome(number, *bounded(lambda k=number: attempt(np.random.default_rng((seed, k)))))


def _attempt_of(kind: str, folder: Path) -> Callable[[Random], bool]:
    """Return what is done with one mutant."""
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


@contextlib.contextmanager
def _folder() -> Iterator[Path]:
    """Return a folder in memory, if there is one: whole files are synchronised with the disk."""
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
        f"One in {WHOLE} of the models is also rolled out, and one in {WHOLE} of a library's files lies beside more of them.",
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
