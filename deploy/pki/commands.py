"""`farhand pki init`, `robot`, `hub`, `operator`, `throw-away`, `renew`, `revoke`, `show`. The help texts here are documentation."""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

if TYPE_CHECKING:
    from farhand.deploy.pki.registry import Registry

SiteName = Annotated[str, tyro.conf.Positional]

_OPERATOR_DAYS, _ROBOT_DAYS = 90, 365


@dataclass(frozen=True, kw_only=True)
class _InFolder:
    folder: str = ""
    """Folder of the authority; empty: pki in the user's data folder, ~/.local/share/farhand."""

    def _path(self) -> Path:
        from farhand.common.names import user_path
        from farhand.deploy.pki.registry import default_folder
        from farhand.deploy.places import data_folder

        return user_path(self.folder, "folder") if self.folder else default_folder(data_folder(""))

    def _registry(self) -> Registry:
        from farhand.deploy.pki.registry import Registry

        return Registry.open(self._path())


@dataclass(frozen=True)
class Init(_InFolder):
    """Make the authority that every robot and operator of a fleet trusts. Keep its folder on one machine ashore."""

    name: str = "farhand"
    """Name of the authority in its certificates."""

    def run(self) -> int:
        """Run the command and return its exit status."""
        from farhand.deploy.pki.registry import Registry

        Registry.create(self._path(), self.name)
        _say(f"the authority is in {self._path()}: keep ca.key secret, whoever has it can pose as any site")
        _say("next: farhand pki robot NAME --san HOST, and farhand pki operator NAME")
        return 0


@dataclass(frozen=True)
class RobotCertificate(_InFolder):
    """Make the certificate of a robot. Without --san the robot can only connect to a hub."""

    name: SiteName
    """The vehicle's name, at most 32 letters, digits, '.', '_' and '-'."""
    san: tuple[str, ...] = ()
    """Host names and addresses that operators dial, without port; with a relay on the way, also the relay's."""
    days: int = _ROBOT_DAYS
    """Days for which the certificate is valid."""

    def run(self) -> int:
        """Run the command and return its exit status."""
        folder = self._registry().issue(self.name, "robot", self.san, self.days)
        if not self.san:
            _say(
                f"copy {folder} to the robot, and there: farhand remote --vehicle {self.name} "
                "--certificates FOLDER --connect quic/HUB:7450"
            )
            return 0
        _say(
            f"copy {folder} and {self._path() / 'sites.json'} to the robot, and there: farhand remote "
            "--certificates FOLDER --sites sites.json --listen quic/0.0.0.0:7447"
        )
        return 0


@dataclass(frozen=True)
class HubCertificate(_InFolder):
    """Make the certificate of a hub, through which robots and operators reach each other."""

    name: SiteName
    """The hub's name, at most 32 letters, digits, '.', '_' and '-'."""
    san: tuple[str, ...]
    """Host names and addresses that robots and operators dial, without port."""
    days: int = _ROBOT_DAYS
    """Days for which the certificate is valid."""

    def run(self) -> int:
        """Run the command and return its exit status."""
        folder = self._registry().issue(self.name, "hub", self.san, self.days)
        _say(
            f"copy {folder} and {self._path() / 'sites.json'} to the hub, and there: farhand hub "
            "--certificates FOLDER --sites sites.json --listen quic/0.0.0.0:7450"
        )
        return 0


@dataclass(frozen=True)
class Operator(_InFolder):
    """Make the certificate of an operator's site."""

    name: SiteName
    """The site's name, at most 16 letters, digits, '.', '_' and '-'; `farhand local --site-name` is the same."""
    observer: bool = False
    """Let the site watch and stop the robot, and nothing else."""
    robots: tuple[str, ...] = ()
    """Names of the robots that the site may reach; every robot when not given."""
    days: int = _OPERATOR_DAYS
    """Days for which the certificate is valid."""

    def run(self) -> int:
        """Run the command and return its exit status."""
        role = "observer" if self.observer else "operator"
        folder = self._registry().issue(self.name, role, (), self.days, robots=self.robots)
        _say(
            f"copy {folder} to the site, and there: farhand local --certificates FOLDER --site-name {self.name} "
            "--connect quic/ROBOT:7447"
        )
        return 0


@dataclass(frozen=True)
class ThrowAway:
    """Make certificates for a robot and an operator on one machine; the authority's key is not kept.

    What is there and good for another fortnight is left as it is. `farhand up` and `demo` make theirs themselves.
    """

    folder: Path
    """Folder in which the folders `robot` and `operator` are made."""
    san: tuple[str, ...] = ("127.0.0.1",)
    """Host names and addresses by which the robot is dialled, without port."""
    robot: str = "rov1"
    """The vehicle's name."""
    operator: str = "operator"
    """Name of the operator's site."""

    def run(self) -> int:
        """Run the command and return its exit status."""
        from farhand.deploy.pki.issue import parse_hosts
        from farhand.deploy.pki.throw_away import keep_throw_away

        folders = self.folder / "robot", self.folder / "operator"
        made = keep_throw_away(folders, self.robot, parse_hosts(self.san), self.operator)
        _say(
            f"{'new certificates are' if made else 'the certificates stay'} in {folders[0]} and {folders[1]}"
        )
        return 0


@dataclass(frozen=True)
class Renew(_InFolder):
    """Make a new certificate for the key, the name and the hosts of a site."""

    name: SiteName
    """Name of the robot or the operator's site."""
    days: int | None = None
    """Days for which the certificate is valid; when not given 365 for a robot or hub, 90 for an operator."""

    def run(self) -> int:
        """Run the command and return its exit status."""
        registry = self._registry()
        right = registry.rights.get(self.name)
        usual = _ROBOT_DAYS if right is not None and not right.is_of_site else _OPERATOR_DAYS
        days = self.days if self.days is not None else usual
        file = registry.renew(self.name, days)
        _say(f"copy {file} over the one of the site: the key stays")
        return 0


@dataclass(frozen=True)
class Revoke(_InFolder):
    """Revoke a name for good: the list of sites marks it as refused, and its key in this folder is deleted."""

    name: SiteName
    """Name of the robot or the operator's site."""

    def run(self) -> int:
        """Run the command and return its exit status."""
        registry = self._registry()
        registry.revoke(self.name)
        _say(
            f"{self.name} is revoked in {self._path() / 'sites.json'}: copy it to the robots and hubs, where it takes effect at once"
        )
        return 0


@dataclass(frozen=True)
class Show(_InFolder):
    """List every site with its role, its hosts and the remaining validity of its certificate.

    The exit status is 3 if a certificate that is not revoked has expired or expires within 14 days, or is damaged.
    """

    json: bool = False
    """Print the list as JSON."""

    def run(self) -> int:
        """Run the command and return its exit status."""
        registry, now = self._registry(), datetime.now(UTC)
        rows = _rows(registry, now)
        if self.json:
            sys.stdout.write(json.dumps(rows, indent=2) + "\n")
        else:
            for row in rows:
                hosts = f", dialled as {', '.join(row['hosts'])}" if row["hosts"] else ""
                reached = f" of {', '.join(row['robots'])}" if row["robots"] else ""
                _say(f"{row['name']}: {row['role']}{reached}{hosts}; {row['state']}")
        return 3 if any(row["needs_renewal"] for row in rows) else 0


Action = (
    Annotated[Init, tyro.conf.subcommand("init", prefix_name=False)]
    | Annotated[RobotCertificate, tyro.conf.subcommand("robot", prefix_name=False)]
    | Annotated[HubCertificate, tyro.conf.subcommand("hub", prefix_name=False)]
    | Annotated[Operator, tyro.conf.subcommand("operator", prefix_name=False)]
    | Annotated[ThrowAway, tyro.conf.subcommand("throw-away", prefix_name=False)]
    | Annotated[Renew, tyro.conf.subcommand("renew", prefix_name=False)]
    | Annotated[Revoke, tyro.conf.subcommand("revoke", prefix_name=False)]
    | Annotated[Show, tyro.conf.subcommand("show", prefix_name=False)]
)


@dataclass(frozen=True)
class Pki:
    """Make and manage the certificates by which robots and operators recognise each other."""

    action: tyro.conf.OmitArgPrefixes[Action]

    def run(self) -> int:
        """Run the command and return its exit status."""
        return self.action.run()


def _rows(registry: Registry, now: datetime) -> list[dict[str, Any]]:
    from farhand.common.link.certificates import WARNING_DAYS, days, shown

    rows = []
    for issued in registry.all():
        fault, revoked = issued.fault(now), issued.right.revoked is not None
        state, needs_renewal, end = fault, not revoked, None
        if issued.certificate is not None:
            end = issued.certificate.not_valid_after_utc
            left = end - now
            state = fault or f"valid until {shown(end)}, {days(left)} left"
            needs_renewal = not revoked and (bool(fault) or left.days < WARNING_DAYS)
        rows.append(
            {
                "name": issued.name, "role": issued.right.role, "robots": list(issued.right.robots), "hosts": list(issued.hosts),
                "valid_until": end.isoformat() if end is not None else None, "revoked": revoked,
                "state": state, "needs_renewal": needs_renewal,
            }
        )  # fmt: skip
    return rows


def _say(text: str) -> None:
    sys.stdout.write(text + "\n")
