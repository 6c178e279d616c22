"""One per cent of the study `mutations`, with its code."""

from __future__ import annotations

import contextlib
import io
import os
import re
import signal
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import tyro

from farhand.common.errors import InvalidConfiguration
from farhand.deploy.cli import COMMANDS
from farhand.evaluation.faults import bounds
from farhand.evaluation.faults import mutation_study as mutations
from farhand.evaluation.faults.bounds import MOST_MB, AttemptOutcome, WrongResult, bounded, guarded, peak_mb
from farhand.evaluation.faults.command_lines import LINES, Line

_FLAGS = {"--help", "--insecure", "--preview", "--forget", "--observer"}


@pytest.mark.parametrize("kind", mutations.KINDS)
def test_mutants_are_refused_in_one_line_or_accepted_and_right(kind: str):
    n = mutations.N_MUTATIONS // 100
    result = mutations.trial({"kind": kind, "seed": 7, "first": 0, "n": n})
    assert not result["findings"]
    assert result["counts"].get("accepted", 0) + result["counts"].get("refused", 0) == n
    assert result["counts"].get("accepted", 0) > 0, "some change nothing that matters"


def test_every_option_of_every_command_is_given_other_values():
    def takes(line: Line) -> set[str]:
        return {f"--{name}" for name in (*line.values, *line.flags)}

    for name, command in COMMANDS.items():
        lines = [line for line in LINES if line.command.split()[0] == name]
        for words in {tuple(line.command.split()[1:]) for line in lines} if name == "pki" else {()}:
            assert "--help" in options_of(command, words)
            given = [line for line in lines if tuple(line.command.split()[1:]) == words or not words]
            assert options_of(command, words) - set().union(*map(takes, given)) <= _FLAGS, (name, words)


def options_of(command: Any, words: tuple[str, ...]) -> set[str]:
    """Return the options that the help of a command names."""
    with pytest.raises(SystemExit), contextlib.redirect_stdout(io.StringIO()) as said:
        tyro.cli(command, args=[*words, "--help"], config=(tyro.conf.FlagCreatePairsOff,))
    return set(re.findall(r"^\W{1,3}(?:-h, )?(--[a-z][a-z-]*)", said.getvalue(), re.MULTILINE))


def test_what_goes_wrong_is_found(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(bounds, "LONGEST_S", 0.3)

    def hang() -> bool:
        while True:
            pass

    def waste() -> bool:
        return bool(np.ones(int((peak_mb() + MOST_MB) * 1.3e6 / 8)).size)

    def refuse() -> bool:
        raise InvalidConfiguration("file\n", "field", "something else")

    def lie() -> bool:
        raise WrongResult("not so")

    def fail() -> bool:
        return bool(1 // 0)

    outcomes = [bounded(each)[0] for each in (hang, waste, refuse, lie, fail)]
    assert [outcome.partition(":")[0] for outcome in outcomes] == [
        "hang", "memory", "refused", "wrong", "traceback",
    ]  # fmt: skip


def test_an_attempt_that_ends_its_process_is_found_and_the_next_ones_go_on():
    def attempts(numbers: range) -> Iterator[AttemptOutcome]:
        for number in numbers:
            if number == 3:
                os.kill(os.getpid(), signal.SIGKILL)
            if number == 5:
                os._exit(7)
            yield AttemptOutcome(number, "refused", 0.0)

    found = list(guarded(attempts, range(2, 8)))
    assert [outcome.number for outcome in found] == [2, 3, 4, 5, 6, 7]
    assert [outcome.words for outcome in found] == [
        "refused", "ended: by signal SIGKILL", "refused", "ended: with status 7", "refused", "refused",
    ]  # fmt: skip


def test_the_study_counts_every_kind_and_names_what_it_found():
    cases = mutations.cases(1_200, 3)
    assert {case["kind"] for case in cases} == set(mutations.KINDS)
    assert all(sum(c["n"] for c in cases if c["kind"] == kind) == 1_200 for kind in mutations.KINDS)
    result = {"kind": "state", "seed": 3, "first": 0, "n": 3, "slowest_s": 0.1}
    good = {**result, "counts": {"accepted": 1, "refused": 2}, "findings": []}
    bad = {**result, "counts": {"refused": 2, "hang": 1}, "findings": [{"number": 2, "outcome": "hang: x"}]}
    assert mutations.summarise([good])[0]["found"] == 0
    summary, text = mutations.summarise([good, bad])
    assert summary["state"]["found"] == summary["found"] == 1 and "state 2: hang: x" in text
