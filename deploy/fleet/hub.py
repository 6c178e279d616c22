"""`farhand hub`: router on the shore side for several robots and operators. The help texts here are documentation."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from farhand.common.link.endpoint import EndpointSettings

_TEND_S = 5.0


@dataclass(frozen=True)
class HubCommand:
    """Run a hub on the shore side: robots and operators connect to it, and a narrow link carries each message once.

    Robots: farhand remote --connect HUB. Operators: farhand local --connect HUB --robots rov1,rov2.
    """

    listen: str = "tcp/127.0.0.1:7450"
    """Endpoint to listen on: quic/0.0.0.0:7450 for other machines, which needs certificates; UDP and TCP of that port."""
    certificates: str = ""
    """Folder that `farhand pki hub` made for this hub; for quic/ and tls/ endpoints, which need one."""
    sites: str = ""
    """The authority's sites.json: robots, operators and observers, and the robots that each may reach. With certificates the
    hub needs it; it is read again when it changes."""

    def run(self) -> int:
        """Run the command and return its exit status."""
        return run_hub(self.listen, self.certificates, self.sites)


def run_hub(listen: str, certificates: str, sites: str) -> int:
    """Serve robots and operators until SIGTERM or Ctrl-C.

    Raises:
        InvalidConfiguration: When the endpoint, the certificate or the list of sites is not in order.
        LinkError: When the endpoint cannot be listened on.
    """
    from farhand.common.link.certificates import SiteCertificate
    from farhand.common.link.hub import Hub
    from farhand.common.process_status import HubFacts
    from farhand.deploy.child_process import follow_parent, say_ready
    from farhand.deploy.outcome import on_end_signal
    from farhand.deploy.status_socket import Identity, serve_status

    follow_parent()
    settings = _settings(listen, certificates, sites)
    name = SiteCertificate.load(settings.certificate_folder).name if certificates else "hub"
    opened: list[Hub] = []

    def facts() -> HubFacts | None:
        if not opened:
            return None
        presence = opened[0].presence()
        return HubFacts(robots=presence.robots, connections=presence.connections)

    stop = threading.Event()
    with serve_status(Identity("hub", name, listen), facts):
        on_end_signal(stop.set)
        opened.append(Hub(settings))
        try:
            say_ready()
            while not stop.wait(_TEND_S):
                opened[0].tend()
        finally:
            opened[0].close()
    return 0


def _settings(listen: str, certificates: str, sites: str) -> EndpointSettings:
    """Return the settings of a hub.

    Raises:
        InvalidConfiguration: When they do not make sense together; names the field and the remedy.
    """
    import msgspec

    from farhand.common.errors import InvalidConfiguration
    from farhand.common.link.endpoint import EndpointSettings
    from farhand.common.wire.codec import field_of

    try:
        settings = msgspec.convert(
            {"listen": listen, "certificates": certificates, "sites": sites, "insecure": True},
            EndpointSettings,
        )
    except msgspec.ValidationError as error:
        raise InvalidConfiguration("command line", *field_of(error)) from error
    if certificates and not sites:
        expected = "the authority's sites.json: without it a hub cannot tell robots from operators"
        raise InvalidConfiguration("command line", "sites", expected)
    if settings.is_open:
        expected = (
            "quic/ or tls/ and --certificates, as anybody who reaches an open hub could speak for a robot; "
            f"without them this machine alone, such as tcp/127.0.0.1:7450; got {listen!r}"
        )
        raise InvalidConfiguration("command line", "listen", expected)
    return settings
