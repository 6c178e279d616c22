"""docs/architecture.md says through which files the four flows pass; every folder says what flows through it."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from docs.flows import flows, flows_of_page

ROOT = Path(__file__).parent.parent
FOLDERS = sorted(
    file.parent
    for package in ("common", "local_site", "remote_site", "deploy", "evaluation")
    for file in (ROOT / package).rglob("__init__.py")
)


@pytest.mark.timeout(400)
def test_the_flows_of_the_page_are_those_that_run():
    """A worker's thread takes part in them, so a file that is passed now and then may be seen or not."""
    found, listed = flows(), flows_of_page()
    for name, files in found.items():
        assert len(listed[name]) > 15
        assert len(listed[name] ^ set(files)) <= 2, f"{name}: run python -m docs.flows"


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: str(folder.relative_to(ROOT)))
def test_every_folder_says_what_it_is_and_is_small_enough_to_be_read(folder: Path):
    assert ast.get_docstring(ast.parse((folder / "__init__.py").read_text(encoding="utf-8")))
    assert len(list(folder.glob("*.py"))) <= 18
