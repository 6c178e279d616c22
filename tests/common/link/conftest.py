"""A robot's end of an encrypted link, with the authority that has issued its certificate."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from farhand.common.address import free_port
from farhand.common.link.endpoint import EndpointSettings
from farhand.common.link.link import ZenohLink
from farhand.common.wire import keys
from farhand.deploy.pki.registry import Registry

HOST = "127.0.0.1"


@pytest.fixture(scope="module")
def registry(tmp_path_factory: pytest.TempPathFactory) -> Registry:
    registry = Registry.create(tmp_path_factory.mktemp("pki") / "pki", "fleet")
    registry.issue("rov1", "robot", (HOST,), 30)
    registry.issue("shore-1", "operator", (), 30)
    return registry


@pytest.fixture
def robot(registry: Registry) -> Iterator[tuple[ZenohLink, int]]:
    """The robot's end, which answers lease requests, and its port."""
    port = free_port("quic")
    link = ZenohLink(
        EndpointSettings(listen=f"quic/{HOST}:{port}", certificates=str(registry.folder_of("rov1")))
    )
    link.serve(keys.LEASE, lambda request: request.answer(request.data[::-1]))
    yield link, port
    link.close()
