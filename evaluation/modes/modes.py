"""Study of the modes: the exhaustive check of one operator and of two, and its mutants."""

from __future__ import annotations

import time
from typing import Any

from farhand.evaluation.modes.mode_mutants import MUTANTS
from farhand.evaluation.modes.mode_space import Exploration, explore

Case = dict[str, Any]

_DEPTH_OF_TWO = 8
_SHORT_DEPTH = 3
_SHORT_MUTANTS = ("couple is allowed in DISARMED", "stop leads to DISARMED", "any age is fresh")


def cases(trials: int | None, seed: int) -> list[Case]:
    """List the two searches and one search per mutant; shortened when a number of trials is given."""
    del seed  # nothing here is random
    if trials is not None:
        short = {"max_depth": _SHORT_DEPTH}
        searches = [{"mutant": "", "operators": n, **short} for n in (1, 2)]
        return searches + [{"mutant": name, "operators": 1, "max_depth": None} for name in _SHORT_MUTANTS]
    return [
        {"mutant": "", "operators": 2, "max_depth": _DEPTH_OF_TWO},
        {"mutant": "", "operators": 1, "max_depth": None},
        *({"mutant": name, "operators": 1, "max_depth": None} for name in MUTANTS),
    ]


def trial(case: Case) -> Case:
    """Run one search."""
    began_s = time.monotonic()
    if case["mutant"]:
        with MUTANTS[case["mutant"]]():
            found = explore(case["operators"], case["max_depth"])
    else:
        found = explore(case["operators"], case["max_depth"])
    return {**case, **_plain(found), "took_s": time.monotonic() - began_s}


def summarise(results: list[Case]) -> tuple[Case, str]:
    """State whether the shipped modes keep every rule and every mutant breaks one."""
    shipped = [result for result in results if not result["mutant"]]
    mutants = [result for result in results if result["mutant"]]
    caught = [result for result in mutants if result["broken"]]
    summary = {
        "broken": [result["broken"] for result in shipped if result["broken"]],
        "n_mutants": len(mutants),
        "n_caught": len(caught),
    }
    lines = [
        "# The modes, exhaustively",
        "",
        "| operators | states | transitions | depth | closed | broken rule |",
    ]
    lines += ["|---|---|---|---|---|---|"]
    for r in shipped:
        closed = "yes" if r["closed"] else f"to depth {r['max_depth']}"
        row = (
            r["operators"],
            f"{r['n_states']:,}",
            f"{r['n_transitions']:,}",
            r["depth"],
            closed,
            r["broken"] or "none",
        )
        lines.append("| " + " | ".join(map(str, row)) + " |")
    lines += [
        "",
        f"{len(caught)} of {len(mutants)} mutants are caught.",
        "",
        "| mutant | rule and events that catch it |",
        "|---|---|",
    ]
    lines += [f"| {r['mutant']} | {r['broken'] or '**not caught**'} |" for r in mutants]
    return summary, "\n".join(lines)


def _plain(found: Exploration) -> Case:
    return {
        "n_states": found.n_states,
        "n_transitions": found.n_transitions,
        "depth": found.depth,
        "closed": found.closed,
        "modes": sorted(found.modes),
        "broken": found.broken,
    }
