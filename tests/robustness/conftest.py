"""A robot process and an operator who holds its lease."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from farhand.common.address import free_port
from farhand.evaluation.harness.farhand_process import HeardProcess
from tests.farhand_process import running
from tests.robustness.raw_operator import RawOperator


@pytest.fixture(scope="module")
def endpoint() -> str:
    return f"tcp/127.0.0.1:{free_port()}"


@pytest.fixture(scope="module")
def robot(endpoint: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[HeardProcess]:
    """A robot so patient that a busy machine makes no operator lose it."""
    config = tmp_path_factory.mktemp("robot") / "remote.toml"
    config.write_text(f'lease_s = 600.0\nmax_age_s = 600.0\n[link]\nlisten = "{endpoint}"\n')
    with running("remote", f"--config={config}") as process:
        process.until("the robot is ready")
        yield process


@pytest.fixture(scope="module")
def holder(robot: HeardProcess, endpoint: str) -> Iterator[RawOperator]:
    operator = RawOperator(endpoint)
    yield operator
    operator.close()


@pytest.fixture
def operator(holder: RawOperator) -> RawOperator:
    """The holder of the lease, with the robot in HOLD."""
    holder.bring_to_hold()
    return holder
