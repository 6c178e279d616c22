"""What several tests look at: three demos, which run beside the other tests and mostly wait."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from farhand.evaluation.harness.farhand_process import HeardProcess

DEMOS = {"lan": ("--transport", "tcp"), "geo": ("--outage", "reset:3"), "leo": ("--outage", "blackhole:3")}


@dataclass(frozen=True)
class Demo:
    """A demo that is running or over."""

    process: HeardProcess
    file: Path

    def result(self) -> dict[str, Any]:
        """Wait for its success."""
        assert self.process.wait() == 0, self.process.words
        return json.loads(self.file.read_text())


@pytest.fixture(scope="session", autouse=True)
def demos(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, Demo]]:
    """All demos, begun before the first test."""
    folder = tmp_path_factory.mktemp("demos")
    begun: dict[str, Demo] = {}
    try:
        for link, more in DEMOS.items():
            file = folder / f"{link}.json"
            process = HeardProcess("demo", "--task", "planar", "--link", link, "--json", file, *more)
            begun[link] = Demo(process, file)
        yield begun
    finally:
        for demo in begun.values():
            demo.process.kill()
