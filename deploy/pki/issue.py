"""Certificates as the sites need them: TLS 1.3, P-256, one authority without intermediates."""

from __future__ import annotations

import ipaddress
import re
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from farhand.common.errors import InvalidConfiguration
from farhand.common.link.certificates import Right, shown, validity_fault

ORGANIZATION = "Farhand"
CA_DAYS = 3650
_BACKDATED = timedelta(hours=1)
"""A site whose clock is behind by less accepts a new certificate at once."""

_HOST = re.compile(r"(?=.{1,253}\Z)([A-Za-z0-9]([A-Za-z0-9-]{0,61}[A-Za-z0-9])?)(\.[A-Za-z0-9]([A-Za-z0-9-]{0,61}[A-Za-z0-9])?)*\Z")  # fmt: skip


@dataclass(frozen=True)
class Authority:
    """Certificate of the authority, and its key.

    Args:
        certificate: The self-signed certificate.
        key: Private key that signs the certificates of the sites.
    """

    certificate: x509.Certificate
    key: ec.EllipticCurvePrivateKey

    @classmethod
    def create(cls, name: str, now: datetime | None = None) -> Authority:
        """Make a new authority.

        Args:
            name: Common name.
            now: Begin of the validity; the present when not given.
        """
        key, now = new_key(), now or datetime.now(UTC)
        subject = _subject(name)
        builder = _builder(subject, subject, key.public_key(), now, now + timedelta(days=CA_DAYS))
        identifier = x509.SubjectKeyIdentifier.from_public_key(key.public_key())
        certificate = (
            builder.add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
            .add_extension(_key_usage(signs_certificates=True), critical=True)
            .add_extension(identifier, critical=False)
            .sign(key, hashes.SHA256())
        )
        return cls(certificate, key)

    def issue(
        self, name: str, public_key: ec.EllipticCurvePublicKey, hosts: tuple[str, ...], days: int,
        now: datetime | None = None,
    ) -> x509.Certificate:  # fmt: skip
        """Return a new certificate of a site.

        A site with hosts is dialled by them, and may dial; one without may only dial: an operator's certificate
        cannot pass for a robot's.

        Args:
            name: Name of the site.
            public_key: Public key of the site.
            hosts: Names and addresses by which the site is dialled, as `parse_hosts` returns them.
            days: Validity of the certificate [days]; it never outlasts the authority.
            now: Begin of the validity; the present when not given.
        """
        now = now or datetime.now(UTC)
        end = min(now + timedelta(days=days), self.certificate.not_valid_after_utc)
        uses = [ExtendedKeyUsageOID.CLIENT_AUTH]
        if hosts:
            uses.insert(0, ExtendedKeyUsageOID.SERVER_AUTH)
        own_identifier = x509.SubjectKeyIdentifier.from_public_key(public_key)
        of_authority = self.certificate.extensions.get_extension_for_class(x509.SubjectKeyIdentifier).value
        builder = (
            _builder(_subject(name), self.certificate.subject, public_key, now, end)
            .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
            .add_extension(_key_usage(signs_certificates=False), critical=True)
            .add_extension(x509.ExtendedKeyUsage(uses), critical=False)
            .add_extension(own_identifier, critical=False)
            .add_extension(
                x509.AuthorityKeyIdentifier.from_issuer_subject_key_identifier(of_authority), critical=False
            )
        )
        if hosts:
            builder = builder.add_extension(
                x509.SubjectAlternativeName(map(_alternative, hosts)), critical=False
            )
        return builder.sign(self.key, hashes.SHA256())


def new_key() -> ec.EllipticCurvePrivateKey:
    """Return a new private key."""
    return ec.generate_private_key(ec.SECP256R1())


def parse_hosts(texts: tuple[str, ...]) -> tuple[str, ...]:
    """Return host names and addresses, each once, in the usual form.

    Raises:
        InvalidConfiguration: When a text is neither; names the text.
    """
    return tuple(dict.fromkeys(_parse_host(text) for text in texts))


def hosts_of(certificate: x509.Certificate) -> tuple[str, ...]:
    """Return the names and addresses by which a site may be dialled."""
    try:
        names = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    except x509.ExtensionNotFound:
        return ()
    return tuple(str(name.value) for name in names)


@dataclass(frozen=True)
class Issued:
    """Site with its newest certificate.

    Args:
        name: The site's name.
        right: Role of the site, and its revocation.
        certificate: The newest certificate; None when its file is missing or damaged.
        damage: Reason why there is no certificate, empty with one.
    """

    name: str
    right: Right
    certificate: x509.Certificate | None
    damage: str = ""

    @property
    def hosts(self) -> tuple[str, ...]:
        """Names and addresses by which the site may be dialled; empty while they are unknown."""
        return hosts_of(self.certificate) if self.certificate is not None else ()

    def fault(self, now: datetime) -> str:
        """Return the reason why it is refused at a time; an empty string when it is not."""
        if self.right.revoked is not None:
            return f"revoked on {shown(self.right.revoked)}"
        return validity_fault(self.certificate, now) if self.certificate is not None else self.damage


def _parse_host(text: str) -> str:
    try:
        return str(ipaddress.ip_address(text.strip("[]")))
    except ValueError:
        last = text.rpartition(".")[2]
        if _HOST.match(text) and not last.isdigit():  # four numbers that are no address are no name either
            return text.lower()
    expected = f"a host name or address that operators dial, without port, such as rov1.example or 10.0.0.5; got {text!r}"
    raise InvalidConfiguration("command line", "san", expected)


def _alternative(host: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ipaddress.ip_address(host))
    except ValueError:
        return x509.DNSName(host)


def _subject(name: str) -> x509.Name:
    return x509.Name(
        [
            x509.NameAttribute(NameOID.ORGANIZATION_NAME, ORGANIZATION),
            x509.NameAttribute(NameOID.COMMON_NAME, name),
        ]
    )


def _builder(
    subject: x509.Name, issuer: x509.Name, key: ec.EllipticCurvePublicKey, now: datetime, end: datetime
) -> x509.CertificateBuilder:
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(key)
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - _BACKDATED)
        .not_valid_after(end)
    )


def _key_usage(*, signs_certificates: bool) -> x509.KeyUsage:
    return x509.KeyUsage(
        digital_signature=not signs_certificates, content_commitment=False, key_encipherment=False,
        data_encipherment=False, key_agreement=False, key_cert_sign=signs_certificates, crl_sign=signs_certificates,
        encipher_only=False, decipher_only=False,
    )  # fmt: skip
