"""Finds out why an encrypted connection does not come about: the transport itself retries for ever, and tells nothing."""

from __future__ import annotations

import socket
import ssl
from pathlib import Path

from farhand.common.address import endpoint_address, show_address
from farhand.common.link.certificates import CA_FILE, CERTIFICATE_FILE, KEY_FILE, SiteCertificate
from farhand.common.link.endpoint import EndpointSettings

_PATIENCE_S = 3.0

_OF_ROBOT = {
    62: "the robot's certificate is not for {host}: dial a name that it has, or make it with --san {host}",
    64: "the robot's certificate is not for {host}: dial a name that it has, or make it with --san {host}",
    10: "the robot's certificate has expired, or the clock of this machine is wrong: farhand pki renew",
    9: "the robot's certificate is not valid yet: is the clock of this machine right?",
    26: "what answers at {where} shows the certificate of an operator, not of a robot",
    79: "what answers at {where} shows the certificate of an operator, not of a robot",
    18: "another authority has issued the robot's certificate",
    19: "another authority has issued the robot's certificate",
    20: "another authority has issued the robot's certificate",
    7: "another authority has issued the robot's certificate",
}
"""By OpenSSL's numbers of what is wrong with a certificate."""
_OF_SITE = {
    "UNKNOWN_CA": "another authority has issued this site's certificate than the robot trusts",
    "DECRYPT_ERROR": "another authority has issued this site's certificate than the robot trusts",
    "CERTIFICATE_EXPIRED": "the robot takes this site's certificate for expired: farhand pki renew, or its clock is wrong",
    "BAD_CERTIFICATE": "the robot does not accept this site's certificate",
    "CERTIFICATE_REQUIRED": "the robot asks for a certificate, and this site shows none",
}
"""By the alert that the robot sends."""


def explain_silence(settings: EndpointSettings, connected: bool) -> str:
    """Return the reason why nothing is heard of the robot over an encrypted link; empty when none is found.

    Args:
        settings: Settings of the site that connects.
        connected: Whether the transport is connected to the robot.
    """
    if not settings.certificates:
        return ""
    if connected:
        name = SiteCertificate.load(settings.certificate_folder).name
        return f"the robot lets {name} in and tells it nothing: does its list of sites name {name}, and not as revoked?"
    return find_refusal(settings.connect, settings.certificate_folder)


def find_refusal(endpoint: str, folder: Path) -> str:
    """Try once to open an encrypted connection, and return the reason why it is refused; empty when it is not.

    The robot answers TLS over TCP at the same port as QUIC, with the same certificate.

    Args:
        endpoint: Endpoint of the robot or of the link process.
        folder: Folder of this site's certificate.
    """
    host, port = endpoint_address(endpoint)
    where = show_address((host, port))
    try:
        context = ssl.create_default_context(cafile=str(folder / CA_FILE))
        context.minimum_version = ssl.TLSVersion.TLSv1_3
        context.load_cert_chain(folder / CERTIFICATE_FILE, folder / KEY_FILE)
        with socket.create_connection((host, port), _PATIENCE_S) as plain:
            try:
                encrypted = context.wrap_socket(plain, server_hostname=host)
            except TimeoutError:
                return f"{where} does not speak TLS: does the robot listen at a quic/ or tls/ endpoint?"
            with encrypted:
                encrypted.recv(
                    1
                )  # what the robot thinks of this site's certificate comes after the handshake
    except ssl.SSLCertVerificationError as error:
        words = _OF_ROBOT.get(
            error.verify_code, f"the robot's certificate is not accepted: {error.verify_message}"
        )
        return words.format(host=host, where=where)
    except ssl.SSLError as error:
        alert = (error.reason or "").partition("ALERT_")[2]
        return _OF_SITE.get(alert, f"{where} does not speak TLS 1.3 as a robot does ({error.reason})")
    except ConnectionRefusedError:
        return f"nobody listens at {where}: is the remote site running, with the same kind of endpoint?"
    except ConnectionError:
        return f"{where} hung up: is the robot's site running behind it?"
    except TimeoutError:
        return ""  # accepted: the robot waits for the first word
    except OSError as error:
        return f"{where} cannot be reached: {error.strerror or error}"
    return ""
