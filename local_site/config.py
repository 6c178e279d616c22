"""Configuration of the local site. `farhand.common.configuration.load_toml` reads it from a file."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta, Struct

from farhand.common.address import parse_address
from farhand.common.clock import LONGEST_WAIT_S
from farhand.common.link.endpoint import EndpointSettings
from farhand.common.names import SiteName, check_name

MOST_ROBOTS = 16
"""Largest number of robots that one operator's site has pages for."""


class LocalConfig(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Configuration of one operator's site."""

    link: EndpointSettings = EndpointSettings(connect="tcp/127.0.0.1:7447")
    robots: str = ""
    """Names of the robots at a hub, with commas between; empty: the one of the link, without a hub."""
    pages: str = ""
    """Ports of the pages of all robots at the hub, as `farhand local --robots` sets them."""
    link_control: str = ""
    """Control socket of the simulated link, host:port; empty for a real link."""
    task: str = "planar"
    """Name of a task that comes with Farhand, or a task file; several, of one robot, with commas between them."""
    own_arm: str = ""
    """The operator's own arm: name of a robot that comes with Farhand, or a robot file; empty: the first of them."""
    site_name: SiteName | None = None
    """Name of this site for the robot and other operators; none: made from the user, the host and the data folder."""
    watch: bool = False
    """Only watch: do not take the control of the robot until asked to. Stop works nevertheless."""
    data_dir: str = ""
    """Folder of demonstrations and models; empty: ~/.local/share/farhand."""
    page_port: Annotated[int, Meta(ge=0, le=65535)] = 0
    """Port of the web page; 0: no page."""
    page_host: Annotated[str, Meta(min_length=1)] = "127.0.0.1"
    """Address of the page's server; 0.0.0.0 or :: for all addresses of this machine. At other addresses than loopback the
    page asks for a token, which the printed address contains. It is not encrypted: put a proxy with TLS before it."""
    page_names: tuple[str, ...] = ()
    """Further hosts that browsers reach the page by, as in their address bar, such as https://console.example."""
    page_published_at: str = ""
    """Address of the container's machine at which the page's port is published, such as 127.0.0.1:8080; empty outside of a
    container. If it is a loopback address, visitors from the container's gateway need no token."""
    connect_timeout_s: Annotated[float, Meta(ge=0, le=LONGEST_WAIT_S)] = 60.0
    """Longest wait for the first report of the robot [s]; 0: for ever."""
    seed: Annotated[int, Meta(ge=0)] = 0
    """Seed of the scripted operator's hand."""

    def __post_init__(self) -> None:
        if not self.link.connect:
            raise ValueError(
                "link.connect: the endpoint of the robot or of the link, such as tcp/127.0.0.1:7447, got ''"
            )
        if self.link_control:
            parse_address(self.link_control, "link_control", "configuration")
        names = self.robot_names
        if len(set(names)) != len(names) or len(names) > MOST_ROBOTS:
            expected = f"at most {MOST_ROBOTS} names, each once, such as rov1,rov2"
            raise ValueError(f"robots: {expected}; got {self.robots!r}")
        pages = self.page_ports
        if self.pages and (not set(names) <= set(pages) or 0 in pages.values()):
            expected = "the port of each robot's page, such as rov1=8080,rov2=8081"
            raise ValueError(f"pages: {expected}; got {self.pages!r}")

    @property
    def robot_names(self) -> tuple[str, ...]:
        """Names of the robots at a hub; none without a hub."""
        return tuple(check_name(name.strip(), "robots") for name in filter(None, self.robots.split(",")))

    @property
    def page_ports(self) -> dict[str, int]:
        """Port of each robot's page; none for a page without others beside it."""
        pairs = (part.partition("=") for part in filter(None, self.pages.split(",")))
        return {check_name(name, "pages"): int(port) if port.isdecimal() else 0 for name, _, port in pairs}
