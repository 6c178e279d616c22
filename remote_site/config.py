"""Configuration of the remote site. `farhand.common.configuration.load_toml` reads it from a file."""

from __future__ import annotations

from typing import Annotated, Any

from msgspec import Meta, Struct

from farhand.common.clock import Wait
from farhand.common.link.endpoint import EndpointSettings


class DriverChoice(Struct, frozen=True, forbid_unknown_fields=True):
    """Choice of a driver among those that installed packages bring along, by entry points."""

    use: str = ""
    """Name of the driver; empty: the simulated one."""
    options: dict[str, Any] = {}
    """Options of the driver, handed to it as they are."""


class RemoteConfig(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Configuration of one robot's site."""

    link: EndpointSettings = EndpointSettings(listen="tcp/127.0.0.1:7447")
    task: str = "planar"
    """Name of a task that comes with Farhand, or a task file; several tasks of one robot with commas between."""
    robot: str = ""
    """Name of a robot that comes with Farhand, or a robot file; empty: the first of them. Of an arm alone."""
    plant: DriverChoice = DriverChoice()
    """Machine of a point's task, from the entry points `farhand.plants`."""
    perception: DriverChoice = DriverChoice()
    """Sight, from the entry points `farhand.perceptions`."""
    arm_driver: DriverChoice = DriverChoice()
    """Machine of an arm's task, from the entry points `farhand.arm_drivers`; it needs a `perception` as well."""
    camera: DriverChoice = DriverChoice()
    """Camera for the operator's page, from the entry points `farhand.cameras`; empty: the simulated arm's own; `none`: no camera."""
    seed: Annotated[int, Meta(ge=0)] = 0
    """Seed of the simulated measurement noise and of the target's phase."""
    control_hz: Annotated[float, Meta(ge=10, le=1000)] | None = None
    """Control rate [Hz]; none: the robot's own. An arm runs at 100 Hz only."""
    telemetry_hz: Annotated[float, Meta(ge=0.1, le=30)] = 25.0
    max_age_s: Wait = 15.0
    """Largest age of a command that is ever accepted [s]."""
    deadline_s: Wait = 0.5
    """Lateness of a control period that counts as a fault while the robot moves [s]."""
    data_dir: str = ""
    """Folder of the events and the state of the simulated robot; empty: the user's data folder."""
    lease_s: Wait = 3.0
    """Silence of the holder after which the control of the robot becomes free [s]."""

    def __post_init__(self) -> None:
        if bool(self.link.listen) == bool(self.link.connect):
            # Both at once would bring each message twice to a site that is at the hub too.
            got = f"both, {self.link.listen!r} and {self.link.connect!r}" if self.link.listen else "neither"
            raise ValueError(
                "link.listen: an endpoint of this machine, such as tcp/127.0.0.1:7447, or else "
                f"link.connect: the endpoint of a hub; got {got}"
            )
