from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.containers.engine import BUILD_S, Engine, find_engine


@pytest.fixture(scope="package")
def engine() -> Iterator[Engine]:
    """An engine on which the three images are built from this work tree."""
    engine = find_engine()
    built = engine.compose_run("build", timeout_s=BUILD_S)
    assert built.returncode == 0, built.stdout[-3000:] + built.stderr[-3000:]
    yield engine
    engine.compose_run("down", "--volumes", "--timeout", "5", timeout_s=120)
