"""Certificates for one run on one machine, which nobody has to make or to delete."""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from farhand.common.link.endpoint import EndpointSettings
from farhand.common.temporary_folder import temporary_folder
from farhand.deploy.pki.registry import CA_KEY, Registry
from farhand.deploy.places import data_folder, site_name

_DAYS = 365
"""Longer than anybody leaves one run alone; the folder is gone afterwards."""

Transport = Literal["tcp", "tls", "quic"]


@dataclass(frozen=True)
class Identities:
    """Arguments that name the sites' certificates.

    Args:
        robot: For the robot's site.
        operator: For the operator's site.
    """

    robot: tuple[str, ...] = ()
    operator: tuple[str, ...] = ()


@contextlib.contextmanager
def throw_away_identities(transport: Transport, data_dir: str) -> Iterator[Identities]:
    """Make certificates for both sites on this machine for the time of the block, if the transport needs some.

    Args:
        transport: Scheme of the endpoints.
        data_dir: Data folder of the operator's site, of which its name is made; empty: the user's.
    """
    if transport == "tcp":
        yield Identities()
        return
    name = site_name(data_folder(data_dir))
    with tempfile.TemporaryDirectory(prefix="farhand-pki-", dir=temporary_folder()) as folder:
        robot, operator = make_throw_away(Path(folder), EndpointSettings().vehicle, ("127.0.0.1",), name)
        yield Identities((f"--certificates={robot}",), (f"--certificates={operator}",))


def make_throw_away(folder: Path, robot: str, hosts: tuple[str, ...], operator: str) -> tuple[Path, Path]:
    """Make an authority, a robot and an operator; the authority's key is not kept.

    Args:
        folder: Where the sites' folders are made.
        robot: Name of the robot.
        hosts: Names and addresses by which it is dialled.
        operator: Name of the operator's site.

    Returns:
        The folders of the robot and of the operator.
    """
    registry = Registry.create(folder, "throw-away")
    folders = (
        registry.issue(robot, "robot", hosts, _DAYS),
        registry.issue(operator, "operator", (), _DAYS),
    )
    (folder / CA_KEY).unlink()
    return folders
