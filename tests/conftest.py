"""What holds for every test."""

from __future__ import annotations

import os
from collections.abc import Generator

import pytest

# Before numpy is imported: small matrices are slower with more BLAS threads.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# Kinds of tests (markers) that may skip where their means are missing, unless FARHAND_REQUIRE names them.
_SKIPPABLE_KINDS = frozenset({"browser", "containers", "rendering", "ros2"})
_REQUIRED_KINDS = pytest.StashKey[frozenset[str]]()


def pytest_configure(config: pytest.Config) -> None:
    required = frozenset(filter(None, os.environ.get("FARHAND_REQUIRE", "").split(",")))
    if unknown := required - _SKIPPABLE_KINDS:
        known = ",".join(sorted(_SKIPPABLE_KINDS))
        raise pytest.UsageError(f"FARHAND_REQUIRE: unknown {','.join(sorted(unknown))}; known: {known}")
    config.stash[_REQUIRED_KINDS] = required


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item,
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """A skip of a required kind is a failure with the reason of the skip."""
    report = yield
    required = {mark.name for mark in item.iter_markers()} & item.config.stash[_REQUIRED_KINDS]
    if report.skipped and required and isinstance(report.longrepr, tuple):
        report.outcome = "failed"
        report.longrepr = f"FARHAND_REQUIRE={','.join(sorted(required))} forbids: {report.longrepr[2]}"
    return report
