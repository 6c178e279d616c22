"""Certificates for one run on one machine, which nobody has to make or to delete."""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from farhand.common.errors import InvalidInput
from farhand.common.link.certificates import CA_FILE, CERTIFICATE_FILE, KEY_FILE, SiteCertificate
from farhand.common.link.endpoint import EndpointSettings
from farhand.common.temporary_folder import temporary_folder
from farhand.common.whole_file import read_whole, write_whole
from farhand.deploy.pki.issue import hosts_of
from farhand.deploy.pki.registry import CA_KEY, Registry
from farhand.deploy.places import data_folder, site_name

_DAYS = 365
"""Longer than anybody leaves one run alone; the folder is gone afterwards."""

Transport = Literal["quic", "tls", "tcp"]
NARROW_BPS = 50_000.0
"""Capacity below which a link is given TLS over TCP: the datagrams of QUIC cost more there than they save [bit/s]."""


@dataclass(frozen=True)
class Identities:
    """Arguments that name the sites' certificates.

    Args:
        robot: For the robot's site.
        operator: For the operator's site.
    """

    robot: tuple[str, ...] = ()
    operator: tuple[str, ...] = ()


def transport_for(rate_bps: float) -> Transport:
    """Return the transport that suits a link.

    Args:
        rate_bps: Capacity of the link [bit/s]; 0: more than enough.
    """
    return "tls" if 0.0 < rate_bps < NARROW_BPS else "quic"


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


def keep_throw_away(folders: tuple[Path, Path], robot: str, hosts: tuple[str, ...], operator: str) -> bool:
    """Make certificates in the folders of both sites, unless those that are there are good for another fortnight.

    Args:
        folders: Folders of the robot and of the operator; they may exist.
        robot: Name of the robot.
        hosts: Names and addresses by which it is dialled.
        operator: Name of the operator's site.

    Returns:
        True if new ones were made.

    Raises:
        InvalidConfiguration: When a name or a host makes no sense.
        OSError: When a file cannot be written.
    """
    if _is_good(folders[0], robot, hosts) and _is_good(folders[1], operator, ()):
        return False
    with tempfile.TemporaryDirectory(prefix="farhand-pki-", dir=temporary_folder()) as scratch:
        for made, kept in zip(make_throw_away(Path(scratch), robot, hosts, operator), folders, strict=True):
            kept.mkdir(mode=0o700, parents=True, exist_ok=True)
            for file in (KEY_FILE, CERTIFICATE_FILE, CA_FILE):
                write_whole(kept / file, read_whole(made / file), new_mode=0o600)
    return True


def _is_good(folder: Path, name: str, hosts: tuple[str, ...]) -> bool:
    try:
        known = SiteCertificate.load(folder)
    except InvalidInput:
        return False
    return (
        known.name == name and hosts_of(known.certificate) == hosts and not (known.fault() or known.warning())
    )
