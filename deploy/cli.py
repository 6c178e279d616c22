"""The command line of Farhand. The help texts here are documentation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import tyro

from farhand.common.log import configure_logging
from farhand.deploy.fleet.hub import HubCommand
from farhand.deploy.offline_commands import (
    Evaluate,
    Import,
    Learn,
    Model,
    RobotCommand,
    RolloutCommand,
    SamplesCommand,
)
from farhand.deploy.outcome import status_of
from farhand.deploy.pki.commands import Pki
from farhand.deploy.standard_streams import standard_streams


@dataclass(frozen=True)
class Up:
    """Run the local site, the remote site and a simulated link on this machine until Ctrl-C."""

    task: str = "hot-stab,hot-stab-removal"
    """Name of a task that comes with Farhand, or a task file; several tasks of one robot with commas between."""
    link: str = "geo"
    """Profile of the simulated link: lan, geo, leo or acoustic."""
    transport: Literal["quic", "tls", "tcp"] | None = None
    """quic and tls encrypt, with certificates that are made for this run alone; tcp does not. Over quic the simulated link
    loses packets. When not given quic, and tls on the narrowest links."""
    port: int = 8080
    """Port of the web page on this machine; 0 takes a free one, which is printed with the page's address."""
    robot: str = ""
    """Robot of an arm's task: name of one that comes with Farhand (an unknown one lists them), or a robot file;
    jaco when not given."""
    own_arm: str = ""
    """The operator's own arm, in the same way; it need not be the robot's."""
    plant: str = ""
    """Machine of your own for a point's task: name of an installed driver; a simulated one when not given."""
    arm_driver: str = ""
    """Machine of your own for an arm's task, in the same way; it needs a perception as well."""
    perception: str = ""
    """Sight of your own, in the same way."""
    camera: str = ""
    """Camera of your own for the page, in the same way; the simulated arm's when not given; none: no camera."""
    remote_config: Path | None = None
    """TOML file of the robot's site, as of `farhand remote --config`; it has the drivers' options."""
    seed: int = 0
    """Seed of all random numbers."""
    data_dir: str = ""
    """Folder of demonstrations, models and events; empty: ~/.local/share/farhand."""

    def run(self) -> int:
        """Run the command and return its exit status."""
        from farhand.deploy.run_settings import RunSettings
        from farhand.deploy.up import run_up

        return run_up(
            RunSettings(
                self.task,
                self.link,
                self.seed,
                self.transport,
                self.robot,
                self.own_arm,
                self.plant,
                self.arm_driver,
                self.perception,
                self.camera,
                self.remote_config,
            ),
            self.port,
            self.data_dir,
        )


@dataclass(frozen=True)
class Demo:
    """Run the whole job on this machine by a script: demonstrate, send, arm, drive, clutch, preview, execute.

    The exit status is 0 only if every task succeeded, or was done and nobody can judge it.
    """

    task: str = "hot-stab"
    """Name of a task that comes with Farhand, or a task file; several tasks of one robot with commas between are done in
    turn, each from the end of the one before."""
    link: str = "geo"
    """Profile of the simulated link: lan, geo, leo or acoustic."""
    robot: str = ""
    """Robot of an arm's task: name of one that comes with Farhand (an unknown one lists them), or a robot file;
    jaco when not given."""
    own_arm: str = ""
    """The operator's own arm, in the same way; it need not be the robot's."""
    plant: str = ""
    """Machine of your own for a point's task: name of an installed driver; a simulated one when not given."""
    arm_driver: str = ""
    """Machine of your own for an arm's task, in the same way; it needs a perception as well."""
    perception: str = ""
    """Sight of your own, in the same way; without a simulation's truth the result is not judged."""
    remote_config: Path | None = None
    """TOML file of the robot's site, as of `farhand remote --config`; it has the drivers' options."""
    seed: int = 0
    """Seed of the hand's tremor, the target's phase, the noise and the link's jitter."""
    transport: Literal["quic", "tls", "tcp"] | None = None
    """quic and tls encrypt, with certificates that are made for this run alone; tcp does not. Over quic the simulated link
    loses packets. When not given quic, and tls on the narrowest links."""
    outage: str = "none"
    """Outage during each execution: stall:10, reset:10 or blackhole:10 (seconds) in the middle of the motion; with @0.2
    behind it, as in stall:10@0.2, after a fifth of the motion."""
    json: Path | None = None
    """File for the result; with several tasks it has the result of each under `tasks`."""
    data_dir: str = ""
    """Folder for demonstrations and models; empty: a temporary folder, removed afterwards."""

    def run(self) -> int:
        """Run the command and return its exit status."""
        from farhand.deploy.run_settings import RunSettings
        from farhand.deploy.site_processes import parse_outage
        from farhand.deploy.up import run_demo

        parse_outage(self.outage)
        settings = RunSettings(
            self.task, self.link, self.seed, self.transport, self.robot, self.own_arm,
            self.plant, self.arm_driver, self.perception, remote_config=self.remote_config,
        )  # fmt: skip
        return run_demo(settings, self.outage, self.json, self.data_dir)


@dataclass(frozen=True)
class Local:
    """Run the operator's site. An option that is not given is as in the file, else as in `local_site/config.py`.

    deploy/local.toml is a file to start from; it has a page.
    """

    config: Path | None = None
    """TOML file; the options of the command line override it."""
    connect: str | None = None
    """Endpoint of the robot, of the link or of a hub; tcp/127.0.0.1:7447 when not given. quic/ROBOT:7447 encrypts, and
    survives loss."""
    robots: str | None = None
    """Names of the robots at a hub, with commas between: each has a page of its own, at --port and the ports after it, and a
    library of its own in the data folder."""
    pages: str | None = None
    """Ports of the pages of all robots, such as rov1=8080,rov2=8081; set by the command itself for each robot."""
    certificates: str | None = None
    """Folder that `farhand pki operator` made for this site; for quic/ and tls/ endpoints, which need one."""
    insecure: bool = False
    """Accept a tcp/ endpoint of another machine: nothing is encrypted, and whoever answers is taken for the robot."""
    link_rate_bps: float | None = None
    """Capacity of the link in each direction [bit/s]; 0: more than enough. A narrow link is shared among the flows."""
    link_control: str | None = None
    """Control socket of the simulated link, host:port; none for a real link."""
    task: str | None = None
    """Name of a task that comes with Farhand, or a task file; several tasks of one robot with commas between; planar
    when not given. The other site needs the same tasks."""
    own_arm: str | None = None
    """The operator's own arm: name of one that comes with Farhand, or a robot file; jaco when not given."""
    port: int | None = None
    """Port of the web page; none or 0: no page."""
    host: str | None = None
    """Address of the page's server; when not given 127.0.0.1, for this machine alone. At other addresses a token is asked for."""
    published_at: str | None = None
    """In a container: address of the machine at which the page's port is published, such as 127.0.0.1:8080."""
    site_name: str | None = None
    """Name of this site for the robot and other operators, at most 16 letters, digits, '.', '_' and '-'; when not given made
    from the user, the host and the data folder. A second site of the same name takes over from the first."""
    watch: bool = False
    """Only watch: do not take the control of the robot until asked to."""
    data_dir: str | None = None
    """Folder of demonstrations, models and events; ~/.local/share/farhand when not given."""
    connect_timeout_s: float | None = None
    """Longest wait for the robot's first report [s]; 0: for ever; 60 when not given."""
    seed: int | None = None
    """Seed of the scripted operator's hand."""
    demo: bool = False
    """Have a scripted operator do the job once; the last line printed is the result as JSON."""
    outage: str = "none"
    """With --demo: outage during the execution, see `farhand demo`."""
    json: Path | None = None
    """With --demo: file for the result."""

    def run(self) -> int:
        """Run the command and return its exit status."""
        from farhand.deploy.site_processes import run_local, run_scripted

        overrides = {
            "link_connect": self.connect, "robots": self.robots, "pages": self.pages, "link_certificates": self.certificates, "link_insecure": self.insecure or None, "link_rate_bps": self.link_rate_bps, "link_control": self.link_control, "task": self.task, "own_arm": self.own_arm,
            "page_port": self.port, "page_host": self.host, "page_published_at": self.published_at, "site_name": self.site_name, "data_dir": self.data_dir, "seed": self.seed,
            "connect_timeout_s": self.connect_timeout_s, "watch": self.watch or None,
        }  # fmt: skip
        if self.demo:
            return run_scripted(self.outage, self.json, self.config, **overrides)
        return run_local(self, self.config, **overrides)


@dataclass(frozen=True)
class Remote:
    """Run the robot's site. An option that is not given is as in the file, else as in `remote_site/config.py`.

    deploy/remote.toml is a file to start from.
    """

    config: Path | None = None
    """TOML file; the options of the command line override it."""
    listen: str | None = None
    """Endpoint to listen on: quic/0.0.0.0:7447 for other machines; when not given tcp/127.0.0.1:7447, for this machine
    alone."""
    connect: str | None = None
    """Endpoint of a hub, in place of one to listen on: quic/HUB:7450."""
    vehicle: str | None = None
    """Name of the robot for its hub and its operators, as in its certificate; rov1 when not given."""
    certificates: str | None = None
    """Folder that `farhand pki robot` made for this robot; for quic/ and tls/ endpoints, which need one."""
    sites: str | None = None
    """The authority's sites.json, with the sites that may command and those that may only watch and stop; without it every
    site with a certificate may command. At a hub the hub has the list."""
    insecure: bool = False
    """Listen at a tcp/ endpoint for other machines: nothing is encrypted, and whoever reaches it may command."""
    link_rate_bps: float | None = None
    """Capacity of the link in each direction [bit/s]; 0: more than enough. A narrow link is shared among the flows."""
    task: str | None = None
    """Name of a task that comes with Farhand, or a task file; several tasks of one robot with commas between; planar
    when not given. The other site needs the same tasks."""
    robot: str | None = None
    """Robot of an arm's task: name of one that comes with Farhand, or a robot file; jaco when not given."""
    plant: str | None = None
    """Machine of your own for a point's task: name of an installed driver, whose options the file has; a simulated one when
    not given."""
    arm_driver: str | None = None
    """Machine of your own for an arm's task, in the same way; it needs a perception as well."""
    perception: str | None = None
    """Sight of your own, in the same way."""
    camera: str | None = None
    """Camera of your own for the page, in the same way; the simulated arm's when not given; none: no camera."""
    data_dir: str | None = None
    """Folder of the events and of the simulated robot's state; ~/.local/share/farhand when not given."""
    seed: int | None = None
    """Seed of the simulated noise and of the target's phase."""

    def run(self) -> int:
        """Run the command and return its exit status."""
        from farhand.deploy.site_processes import run_remote

        return run_remote(
            self.config,
            link_listen=self.listen,
            link_connect=self.connect,
            link_vehicle=self.vehicle,
            link_certificates=self.certificates,
            link_sites=self.sites,
            link_insecure=self.insecure or None,
            link_rate_bps=self.link_rate_bps,
            task=self.task,
            robot=self.robot,
            plant_use=self.plant,
            arm_driver_use=self.arm_driver,
            perception_use=self.perception,
            camera_use=self.camera,
            data_dir=self.data_dir,
            seed=self.seed,
        )


@dataclass(frozen=True)
class LinkCommand:
    """Run the simulated link: a relay of TCP and UDP with delay, loss and outages, adjustable over its control socket."""

    listen: str = "127.0.0.1:7448"
    """Address for the local site to connect to, host:port, for TCP and UDP alike."""
    target: str = "127.0.0.1:7447"
    """Address of the remote site, host:port."""
    control: str = "127.0.0.1:7449"
    """Address of the control socket, host:port. It has no access control: keep it on this machine."""
    profile: str = "geo"
    """Profile of the link: lan, geo, leo or acoustic."""
    seed: int = 0
    """Seed of jitter, loss and all other random numbers."""

    def run(self) -> int:
        """Run the command and return its exit status."""
        from farhand.deploy.site_processes import run_link_process

        return run_link_process(self.listen, self.target, self.control, self.profile, self.seed)


@dataclass(frozen=True)
class Status:
    """Ask the processes of this user on this machine how they are: robot, link, hub and operator's site.

    The exit status is 0 if all asked processes are healthy, 3 if one has a trouble, 4 if none is running.
    """

    of: Literal["all", "robot", "link", "hub", "operator"] = "all"
    """Kind of the processes to ask; unless it is all, one must be running."""
    json: bool = False
    """Print the answers and the troubles as JSON."""
    forget: bool = False
    """Forget the processes that have ended."""
    connect: str = ""
    """Endpoint of a hub: list the robots that are there in place of the processes of this machine."""
    certificates: str = ""
    """With --connect: folder of this site's certificate."""

    def run(self) -> int:
        """Run the command and return its exit status."""
        if self.connect:
            from farhand.deploy.fleet.hub_status import run_hub_status

            return run_hub_status(self.connect, self.certificates, self.json)
        from farhand.deploy.status import run_status

        return run_status(self.of, self.json, self.forget)


COMMANDS = {
    "up": Up, "demo": Demo, "local": Local, "remote": Remote, "link": LinkCommand, "hub": HubCommand, "status": Status, "learn": Learn, "rollout": RolloutCommand,
    "model": Model, "evaluate": Evaluate, "import": Import, "samples": SamplesCommand, "robot": RobotCommand, "pki": Pki,
}  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Returns:
        The exit status: 0 for success, 2 for wrong input, 130 for Ctrl-C, 1 for any other failure.
    """
    with standard_streams() as streams:
        try:
            chosen = tyro.extras.subcommand_cli_from_dict(
                COMMANDS,
                prog="farhand",
                description="Supervisory teleoperation: demonstrate here, execute there. `farhand --version` prints the version.",
                args=arguments,
                config=(tyro.conf.FlagCreatePairsOff, tyro.conf.HelptextFromCommentsOff),
            )
        except SystemExit as end:  # after --help, or after a message about wrong arguments
            return streams.final_status(end.code if isinstance(end.code, int) else 1)
        configure_logging(next(name for name, command in COMMANDS.items() if type(chosen) is command))
        return streams.final_status(status_of(chosen))
