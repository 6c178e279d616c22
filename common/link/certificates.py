"""Certificate of a site: its three files, its validity, and the list of rights."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Literal

import msgspec
from cryptography import x509
from cryptography.hazmat.primitives.serialization import load_pem_private_key
from cryptography.x509.oid import NameOID

from farhand.common.errors import InvalidConfiguration, LinkError
from farhand.common.names import Name
from farhand.common.whole_file import fault_of, read_whole

CA_FILE, CERTIFICATE_FILE, KEY_FILE = "ca.pem", "certificate.pem", "key.pem"
RIGHTS_FILE = "sites.json"
WARNING_DAYS = 14
"""Days before its end from which a certificate causes a warning."""

Role = Literal["robot", "hub", "operator", "observer"]


class Right(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, omit_defaults=True):
    """Role of a name.

    Args:
        role: Robots are commanded; hubs connect robots and operators; operators command; observers watch and may stop.
        revoked: Time since which the name is refused; None while it is accepted.
        robots: Robots that an operator or observer may reach; all of them when empty.
    """

    role: Role
    revoked: datetime | None = None
    robots: tuple[Name, ...] = ()

    @property
    def is_of_site(self) -> bool:
        """True for an operator or observer that is accepted."""
        return self.revoked is None and self.role in ("operator", "observer")

    def reaches(self, robot: str) -> bool:
        """Decide whether it is for a robot."""
        return not self.robots or robot in self.robots


@dataclass(frozen=True)
class SiteCertificate:
    """Folder of a site's certificate, with the certificate.

    Args:
        folder: Holds `ca.pem`, `certificate.pem` and `key.pem`.
        certificate: Certificate of the site.
    """

    folder: Path
    certificate: x509.Certificate

    @classmethod
    def load(cls, folder: Path) -> SiteCertificate:
        """Read the folder and check that its files belong together.

        Raises:
            InvalidConfiguration: When a file is missing or malformed, the key does not belong to the
                certificate, or another authority has issued it; names the file and the remedy.
        """
        certificate = read_certificate(folder / CERTIFICATE_FILE)
        authority = read_certificate(folder / CA_FILE)
        with fault_of(folder / KEY_FILE, InvalidConfiguration, "a private key in PEM, without a password"):
            key = load_pem_private_key(read_whole(folder / KEY_FILE), None)
        if key.public_key() != certificate.public_key():
            expected = f"the key of {CERTIFICATE_FILE}: copy all files of the site again"
            raise InvalidConfiguration(str(folder / KEY_FILE), "", expected)
        try:
            certificate.verify_directly_issued_by(authority)
        except Exception as error:  # other names, another kind of key, a wrong signature
            expected = f"issued by the authority of {CA_FILE}: copy all files of the site again"
            raise InvalidConfiguration(str(folder / CERTIFICATE_FILE), "", expected) from error
        return cls(folder, certificate)

    @property
    def name(self) -> str:
        """Name of the site: the certificate's common name."""
        return common_name(self.certificate)

    def fault(self, now: datetime | None = None) -> str:
        """Return the reason why the certificate is not accepted at a time; an empty string when it is.

        Args:
            now: The time; the present when not given.
        """
        return validity_fault(self.certificate, now)

    def warning(self, now: datetime | None = None) -> str:
        """Return a warning of the certificate's end; empty while that is far away.

        Args:
            now: The time; the present when not given.
        """
        left = self.certificate.not_valid_after_utc - (now or datetime.now(UTC))
        if left > timedelta(days=WARNING_DAYS) or self.fault(now):
            return ""
        return f"the certificate of {self.name} expires in {days(left)}: farhand pki renew {self.name}"


def read_certificate(file: Path) -> x509.Certificate:
    """Return the certificate of a PEM file.

    Raises:
        InvalidConfiguration: When it cannot be read or is not a certificate; names the file.
    """
    with fault_of(file, InvalidConfiguration, "a certificate in PEM"):
        return x509.load_pem_x509_certificate(read_whole(file))


def check_site_certificate(folder: Path, warn: Callable[[str], None]) -> None:
    """Check that the other site can accept this one's certificate.

    Otherwise the transport would retry forever without a message.

    Args:
        folder: Folder of the certificate.
        warn: Called with a warning of its end.

    Raises:
        InvalidConfiguration: When the folder is incomplete or malformed; names the file.
        LinkError: When the certificate has expired, or is not valid yet.
    """
    certificate = SiteCertificate.load(folder)
    if fault := certificate.fault():
        raise LinkError(f"{fault}: farhand pki renew {certificate.name}")
    if warning := certificate.warning():
        warn(warning)


def read_rights(file: Path) -> dict[str, Right]:
    """Return the rights of every name that an authority has issued.

    Raises:
        InvalidConfiguration: When the file cannot be read or is not such a list; names file and field.
    """
    with fault_of(file, InvalidConfiguration, "a list of sites in JSON"):
        return msgspec.json.decode(read_whole(file), type=dict[Name, Right])


def common_name(certificate: x509.Certificate) -> str:
    """Return the certificate's common name, empty without one."""
    names = certificate.subject.get_attributes_for_oid(NameOID.COMMON_NAME)
    return str(names[0].value) if names else ""


def validity_fault(certificate: x509.Certificate, now: datetime | None = None) -> str:
    """Return the reason why a certificate is not valid at a time; an empty string when it is.

    Args:
        certificate: Any certificate.
        now: The time; the present when not given.
    """
    now = now or datetime.now(UTC)
    name = common_name(certificate)
    if now > certificate.not_valid_after_utc:
        return f"the certificate of {name} expired on {shown(certificate.not_valid_after_utc)}"
    if now < certificate.not_valid_before_utc:
        since = shown(certificate.not_valid_before_utc)
        return f"the certificate of {name} is not valid before {since}: is the clock of this machine right?"
    return ""


def shown(time: datetime) -> str:
    """Format a time for people, in UTC."""
    return f"{time:%Y-%m-%d %H:%M} UTC"


def days(left: timedelta) -> str:
    """Format a duration in whole days, the last day in hours."""
    if left < timedelta(days=1):
        return f"{left // timedelta(hours=1)} hours"
    return f"{left.days} day{'s' if left.days > 1 else ''}"
