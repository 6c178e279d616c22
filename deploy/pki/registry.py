"""Folder of the authority: its key, a folder for each site, and the list of the sites' rights.

ca.pem, ca.key            the authority; the key never leaves this folder
sites.json                every issued name with its role and, if revoked, the date
sites/NAME/ca.pem         these three files go to the site, and no others
sites/NAME/certificate.pem
sites/NAME/key.pem
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from pathlib import Path

import msgspec
from cryptography import x509
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import (
    Encoding,
    NoEncryption,
    PrivateFormat,
    load_pem_private_key,
)

from farhand.common.errors import InvalidConfiguration
from farhand.common.link.certificates import (
    CA_FILE,
    CERTIFICATE_FILE,
    KEY_FILE,
    RIGHTS_FILE,
    Right,
    Role,
    read_certificate,
    read_rights,
)
from farhand.common.names import MOST_SITE_NAME, check_name
from farhand.common.whole_file import Claim, all_or_none, fault_of, read_whole, write_whole
from farhand.deploy.pki.issue import Authority, Issued, hosts_of, new_key, parse_hosts

CA_KEY = "ca.key"
_MOST_DAYS = 3650


class Registry:
    """Authority with its files. Use `create` or `open`.

    Each change raises `FolderInUse` while another process makes one.
    """

    def __init__(self, folder: Path, authority: Authority, rights: dict[str, Right]):
        self._folder, self._authority, self._rights = folder, authority, rights

    @classmethod
    def create(cls, folder: Path, name: str, now: datetime | None = None) -> Registry:
        """Make a new authority in a folder without one.

        Raises:
            InvalidConfiguration: When the folder has an authority, whose certificates would become worthless.
            OSError: When the folder cannot be written; nothing of the authority is left in it.
        """
        check_name(name, "name", most=64)
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        with _claim(folder):
            if (folder / CA_KEY).exists() or (folder / CA_FILE).exists():
                expected = (
                    f"a folder without an authority; {folder} has one, which a new one would make worthless"
                )
                raise InvalidConfiguration("command line", "folder", expected)
            registry = cls(folder, Authority.create(name, now), {})
            with all_or_none(folder / CA_KEY, folder / CA_FILE, folder / RIGHTS_FILE):
                _write_key(folder / CA_KEY, registry._authority.key)
                write_whole(folder / CA_FILE, _pem(registry.authority))
                registry._write_rights()
        return registry

    @classmethod
    def open(cls, folder: Path) -> Registry:
        """Read the folder of an authority.

        Raises:
            InvalidConfiguration: When there is no authority, or one of its files is malformed; names the file.
        """
        if not (folder / CA_KEY).exists():
            expected = f"the folder of an authority, which `farhand pki init` makes; {folder} has no {CA_KEY}"
            raise InvalidConfiguration("command line", "folder", expected)
        certificate = read_certificate(folder / CA_FILE)
        with fault_of(folder / CA_KEY, InvalidConfiguration, "a private key in PEM, without a password"):
            key = load_pem_private_key(read_whole(folder / CA_KEY), None)
        if not isinstance(key, ec.EllipticCurvePrivateKey) or key.public_key() != certificate.public_key():
            raise InvalidConfiguration(str(folder / CA_KEY), "", f"the key of {CA_FILE}")
        return cls(folder, Authority(certificate, key), read_rights(folder / RIGHTS_FILE))

    def issue(
        self, name: str, role: Role, hosts: tuple[str, ...], days: int, now: datetime | None = None,
        robots: tuple[str, ...] = (),
    ) -> Path:  # fmt: skip
        """Make key and certificate of a new site.

        Args:
            name: Name of the site, never issued before.
            role: Role of the site, which sets its rights.
            hosts: Names and addresses by which a hub or a robot is dialled; none for a site that only dials.
            days: Validity of the certificate [days].
            now: Present time; read from the clock when not given.
            robots: Robots that an operator or observer may reach; all of them when empty.

        Returns:
            The folder that goes to the site.

        Raises:
            InvalidConfiguration: When the name is known or malformed, a host or the days make no sense.
            OSError: When a file cannot be written; nothing of the site is left.
        """
        check_name(name, "name", most=32 if role in ("robot", "hub") else MOST_SITE_NAME)
        for robot in robots:
            check_name(robot, "robots")
        if role == "hub" and not hosts:
            expected = "at least one host name or address by which robots and operators dial the hub"
            raise InvalidConfiguration("command line", "san", expected)
        hosts, days = parse_hosts(hosts), _checked_days(days)
        with self._changing():
            self._check_new(name)
            return self._issue(name, Right(role=role, robots=robots), hosts, days, now)

    def _check_new(self, name: str) -> None:
        if (known := self._rights.get(name)) is not None:
            remedy = "choose another name, it stays refused" if known.revoked else f"farhand pki renew {name}"
            state = "was revoked" if known.revoked else f"is known as {known.role}"
            raise InvalidConfiguration("command line", "name", f"a new name; {name} {state}: {remedy}")

    def _issue(
        self, name: str, right: Right, hosts: tuple[str, ...], days: int, now: datetime | None
    ) -> Path:
        folder, key = self.folder_of(name), new_key()
        certificate = self._authority.issue(name, key.public_key(), hosts, days, now)
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        # A certificate that the list lacks could never be revoked.
        with all_or_none(*(folder / file for file in (KEY_FILE, CERTIFICATE_FILE, CA_FILE))):
            _write_key(folder / KEY_FILE, key)
            write_whole(folder / CERTIFICATE_FILE, _pem(certificate))
            write_whole(folder / CA_FILE, _pem(self.authority))
            self._rights[name] = right
            self._write_rights()
        return folder

    def renew(self, name: str, days: int, now: datetime | None = None) -> Path:
        """Make a new certificate for the key, the name and the hosts of a site.

        Args:
            name: The site's name.
            days: Validity of the certificate [days].
            now: Present time; read from the clock when not given.

        Returns:
            The file of the certificate, the only one that goes to the site.

        Raises:
            InvalidConfiguration: When the name is unknown or revoked, its certificate is missing or damaged, or the
                days make no sense.
        """
        file = self.folder_of(name) / CERTIFICATE_FILE
        with self._changing():
            if self._right(name).revoked is not None:
                raise InvalidConfiguration("command line", "name", f"a name that is not revoked, got {name}")
            old = read_certificate(file)
            key = old.public_key()
            if not isinstance(key, ec.EllipticCurvePublicKey):
                raise InvalidConfiguration(
                    str(self.folder_of(name)), "", "a certificate that this authority issued"
                )
            certificate = self._authority.issue(name, key, hosts_of(old), _checked_days(days), now)
            write_whole(file, _pem(certificate))
        return file

    def revoke(self, name: str, now: datetime | None = None) -> None:
        """Revoke a name for good, and delete its key in this folder; its certificate may be lost or damaged.

        Raises:
            InvalidConfiguration: When the name is unknown; to revoke twice changes nothing.
        """
        with self._changing():
            right = self._right(name)
            if right.revoked is None:
                moment = (now or datetime.now(UTC)).replace(microsecond=0)
                self._rights[name] = msgspec.structs.replace(right, revoked=moment)
                self._write_rights()
            (self.folder_of(name) / KEY_FILE).unlink(missing_ok=True)

    def all(self) -> Iterator[Issued]:
        """Yield every site in the order in which they were issued, with the damage of what cannot be read."""
        for name, right in self._rights.items():
            try:
                yield Issued(name, right, read_certificate(self.folder_of(name) / CERTIFICATE_FILE))
            except InvalidConfiguration as error:
                yield Issued(name, right, None, str(error))

    @property
    def rights(self) -> Mapping[str, Right]:
        """Right of every issued name."""
        return self._rights

    @property
    def authority(self) -> x509.Certificate:
        """The authority's certificate."""
        return self._authority.certificate

    def folder_of(self, name: str) -> Path:
        """Return the folder of a site's three files."""
        return self._folder / "sites" / name

    @contextlib.contextmanager
    def _changing(self) -> Iterator[None]:
        """Keep other processes out while the list is read and written; it would forget what they did."""
        with _claim(self._folder):
            self._rights = read_rights(self._folder / RIGHTS_FILE)
            yield

    def _right(self, name: str) -> Right:
        if name not in self._rights:
            known = ", ".join(self._rights) or "none yet"
            raise InvalidConfiguration(
                "command line", "name", f"a name that was issued ({known}), got {name!r}"
            )
        return self._rights[name]

    def _write_rights(self) -> None:
        content = msgspec.json.format(msgspec.json.encode(self._rights), indent=2)
        write_whole(self._folder / RIGHTS_FILE, content + b"\n")


def _claim(folder: Path) -> Claim:
    return Claim(folder, "the authority", "repeat the command once that process has ended")


def default_folder(data_folder: Path) -> Path:
    """Return where the authority is when nobody says otherwise."""
    return data_folder / "pki"


def _checked_days(days: int) -> int:
    if not 1 <= days <= _MOST_DAYS:
        raise InvalidConfiguration("command line", "days", f"1 to {_MOST_DAYS} days, got {days}")
    return days


def _pem(certificate: x509.Certificate) -> bytes:
    return certificate.public_bytes(Encoding.PEM)


def _write_key(file: Path, key: ec.EllipticCurvePrivateKey) -> None:
    data = key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())
    write_whole(file, data, new_mode=0o600)
