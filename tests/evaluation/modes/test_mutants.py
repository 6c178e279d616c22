"""The mutants of the exhaustive check, each on the events that caught it in full."""

from __future__ import annotations

from pathlib import Path

import pytest

from farhand.evaluation.modes.mode_space import explore
from farhand.evaluation.modes.modes import MUTANTS

PAGE = Path(__file__).parents[3] / "docs" / "results" / "modes.md"


def caught_by() -> dict[str, str]:
    """What the published page says of each mutant: the rule that it broke, and the events."""
    rows = [line.strip("| ").split(" | ") for line in PAGE.read_text().splitlines() if line.startswith("| ")]
    return {row[0]: row[1] for row in rows if len(row) == 2}


def test_the_page_names_every_mutant():
    assert set(MUTANTS) <= set(caught_by())


@pytest.mark.parametrize("mutant", MUTANTS)
def test_each_mutant_is_caught_among_the_events_that_the_page_names_and_the_shipped_modes_are_not(mutant):
    events = caught_by()[mutant]
    with MUTANTS[mutant]():
        assert explore(1, 8, among=events).broken
    assert not explore(1, 4, among=events).broken
