"""docs/deployment.md names what exists: troubles, exit statuses, profiles, variables and networks, all of them."""

from __future__ import annotations

import re
from pathlib import Path

from farhand.common.impairment.link_profile import load_profiles
from farhand.deploy.link.link_process import PROFILES_FILE
from farhand.deploy.status import DEGRADED, HEALTHY, NOT_THERE
from tests.deploy.test_diagnosis import CASES

ROOT = Path(__file__).parent.parent
PAGE = (ROOT / "docs" / "deployment.md").read_text(encoding="utf-8")
ARCHITECTURE = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
CONTAINERS = PAGE.partition("\n## Containers\n")[2].partition("\n## ")[0]
COMPOSE = {path.name: path.read_text(encoding="utf-8") for path in (ROOT / "docker").glob("*.yaml")}
NEEDS_NO_OTHER_PROCESS = {"page-only"}
"""Troubles that are planted elsewhere in tests/deploy/test_diagnosis.py."""


def first_cells(after: str) -> set[str]:
    """The quoted words in the first column of the table whose heading begins so."""
    rows = PAGE.partition(f"\n| {after} |")[2].partition("\n\n")[0].splitlines()[2:]
    return {word for row in rows for word in re.findall(r"`?([\w-]+)`?", row.split("|")[1])}


def test_each_trouble_and_exit_status_is_named() -> None:
    assert first_cells("trouble") == {code for code, _ in CASES} | NEEDS_NO_OTHER_PROCESS
    assert first_cells("exit status") == {str(code) for code in (HEALTHY, DEGRADED, NOT_THERE)}


def test_each_profile_is_named() -> None:
    assert first_cells("profile") == set(load_profiles(PROFILES_FILE))


def test_each_variable_that_is_named_is_read_and_each_that_is_read_is_named() -> None:
    """Above compose.yaml those that the page leaves to it."""
    variables = r"FARHAND_[A-Z_]+"
    read = {name for text in COMPOSE.values() for name in re.findall(rf"\$\{{({variables})", text)}
    named = set(re.findall(variables, CONTAINERS))
    comments = {name for text in COMPOSE.values() for name in re.findall(rf"# .*?({variables})", text)}
    assert named <= read
    assert read <= named | comments


def test_each_network_is_named_and_drawn_alike() -> None:
    section = COMPOSE["compose.yaml"].partition("\nnetworks:\n")[2].partition("\nvolumes:\n")[0]
    networks = re.findall(r"^  (\w+):", section, re.MULTILINE)
    assert first_cells("network") == set(networks)
    drawn, again = (
        re.findall(r"```\n( +subsea.*?control.*?)\n```", page, re.DOTALL) for page in (PAGE, ARCHITECTURE)
    )
    assert drawn and drawn == again
    assert all(name in drawn[0] for name in networks)
