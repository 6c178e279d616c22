"""The command line of Farhand. The help texts here are documentation."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import tyro

from farhand.common.log import configure_logging
from farhand.deploy.entry import run
from farhand.deploy.offline_commands import Evaluate, Import, Learn, Model, Rollout, Samples
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
    transport: Literal["tcp", "quic"] = "tcp"
    """quic encrypts, with certificates that are made for this run alone; lost packets of the simulated link are lost."""
    port: int = 8080
    """Port of the web page on this machine; 0 takes a free one, which is said when the page is there."""
    seed: int = 0
    """Seed of all random numbers."""
    data_dir: str = ""
    """Where demonstrations, models and events are kept; empty: ~/.local/share/farhand."""

    def run(self) -> int:
        """Do it."""
        from farhand.deploy.up import Together, run_up

        return run_up(Together(self.task, self.link, self.seed, self.transport), self.port, self.data_dir)


@dataclass(frozen=True)
class Demo:
    """Run the whole job on this machine by script: demonstrate, send, arm, drive, clutch, preview, execute.

    The exit status is 0 only if every task succeeded.
    """

    task: str = "hot-stab"
    """Name of a task that comes with Farhand, or a task file; several tasks of one robot with commas between are done one
    after the other, each from where the one before ended."""
    link: str = "geo"
    """Profile of the simulated link: lan, geo, leo or acoustic."""
    seed: int = 0
    """Seed of the hand's tremor, the target's phase, the noise and the link's jitter."""
    transport: Literal["tcp", "quic"] = "tcp"
    """quic encrypts, with certificates that are made for this run alone; lost packets of the simulated link are lost."""
    outage: str = "none"
    """Cut the link during each execution: stall:10, reset:10 or blackhole:10 (seconds), in its middle, or elsewhere:
    stall:10@0.2 when a fifth of the motion is done."""
    json: Path | None = None
    """Write what happened to this file; of several tasks, what happened with each under `tasks`."""
    data_dir: str = ""
    """Where demonstrations and models go; empty: a folder that is removed afterwards."""

    def run(self) -> int:
        """Do it."""
        from farhand.deploy.processes import parse_outage
        from farhand.deploy.up import Together, run_demo

        parse_outage(self.outage)
        together = Together(self.task, self.link, self.seed, self.transport)
        return run_demo(together, self.outage, self.json, self.data_dir)


@dataclass(frozen=True)
class Local:
    """Run the operator's site. What is not said here is as in the file, or else as `local_site/config.py` has it.

    One to start from: deploy/local.toml, which has a page.
    """

    config: Path | None = None
    """TOML file; what is named here on the command line overrides it."""
    connect: str | None = None
    """Endpoint of the robot or of the link; tcp/127.0.0.1:7447 when not said. quic/ROBOT:7447 encrypts, and survives loss."""
    certificates: str | None = None
    """Folder that `farhand pki operator` made for this site; for quic/ and tls/ endpoints, which need one."""
    link_rate_bps: float | None = None
    """What the link carries each way [bit/s]; 0: more than enough. Each flow has its share of a narrow one."""
    link_control: str | None = None
    """Control socket of the link process, host:port; without one the link is a real one."""
    task: str | None = None
    """Name of a task that comes with Farhand, or a task file; several tasks of one robot with commas between; planar
    when not said. The other site needs the same."""
    port: int | None = None
    """Port of the web page; without one, or with 0, there is no page."""
    host: str | None = None
    """Address that the page is served at; 127.0.0.1, for this machine alone, when not said. Off loopback it asks for a token."""
    published_at: str | None = None
    """In a container: where the page's port is published on its machine, such as 127.0.0.1:8080."""
    site_name: str | None = None
    """What the robot and other operators call this place, at most 16 letters, digits, '.', '_' and '-'; made from the user,
    the host and the data folder when not said. A second site of the same name takes over from the first."""
    watch: bool = False
    """Only watch: never take the control of the robot by itself."""
    data_dir: str | None = None
    """Where demonstrations, models and events are kept; ~/.local/share/farhand when not said."""
    connect_timeout_s: float | None = None
    """How long to wait for the robot's first report [s], 0 for ever; 60 when not said."""
    seed: int | None = None
    """Seed of the scripted operator's hand."""
    demo: bool = False
    """Have a scripted operator do the job once; the last line printed is the result as JSON."""
    outage: str = "none"
    """With --demo: cut the link during the execution, see `farhand demo`."""
    json: Path | None = None
    """With --demo: write the result to this file as well."""

    def run(self) -> int:
        """Do it."""
        from farhand.deploy.processes import run_local, run_scripted

        overrides = {
            "link_connect": self.connect, "link_certificates": self.certificates, "link_rate_bps": self.link_rate_bps, "link_control": self.link_control, "task": self.task,
            "page_port": self.port, "page_host": self.host, "page_published_at": self.published_at, "site_name": self.site_name, "data_dir": self.data_dir, "seed": self.seed,
            "connect_timeout_s": self.connect_timeout_s, "watch": self.watch or None,
        }  # fmt: skip
        if self.demo:
            return run_scripted(self.outage, self.json, self.config, **overrides)
        return run_local(self.config, **overrides)


@dataclass(frozen=True)
class Remote:
    """Run the robot's site. What is not said here is as in the file, or else as `remote_site/config.py` has it.

    One to start from: deploy/remote.toml.
    """

    config: Path | None = None
    """TOML file; what is named here on the command line overrides it."""
    listen: str | None = None
    """Endpoint to listen on: quic/0.0.0.0:7447 or, in the clear, tcp/0.0.0.0:7447 for other machines; tcp/127.0.0.1:7447, for
    this one, when not said."""
    certificates: str | None = None
    """Folder that `farhand pki robot` made for this robot; for quic/ and tls/ endpoints, which need one."""
    sites: str | None = None
    """The authority's sites.json: who may command, and who only watch and stop; without it whoever has a certificate may."""
    link_rate_bps: float | None = None
    """What the link carries each way [bit/s]; 0: more than enough. Each flow has its share of a narrow one."""
    task: str | None = None
    """Name of a task that comes with Farhand, or a task file; several tasks of one robot with commas between; planar
    when not said. The other site needs the same."""
    data_dir: str | None = None
    """Where the events and the state of the simulated robot are kept; ~/.local/share/farhand when not said."""
    seed: int | None = None
    """Seed of the simulated noise and of the target's phase."""

    def run(self) -> int:
        """Do it."""
        from farhand.deploy.processes import run_remote

        return run_remote(
            self.config,
            link_listen=self.listen,
            link_certificates=self.certificates,
            link_sites=self.sites,
            link_rate_bps=self.link_rate_bps,
            task=self.task,
            data_dir=self.data_dir,
            seed=self.seed,
        )


@dataclass(frozen=True)
class Link:
    """Run the simulated link: a relay of TCP and UDP that delays, loses and cuts, adjustable over its control socket."""

    listen: str = "127.0.0.1:7448"
    """Where the local site connects, host:port, for TCP and UDP alike."""
    target: str = "127.0.0.1:7447"
    """Where the remote site listens, host:port."""
    control: str = "127.0.0.1:7449"
    """Where the link is controlled; it has no access control: keep it on this machine, host:port."""
    profile: str = "geo"
    """lan, geo, leo or acoustic."""
    seed: int = 0
    """Seed of jitter, loss and all other random numbers."""

    def run(self) -> int:
        """Do it."""
        from farhand.deploy.processes import run_link_process

        return run_link_process(self.listen, self.target, self.control, self.profile, self.seed)


@dataclass(frozen=True)
class Status:
    """Ask the processes of this user on this machine how they are: robot, link and operator's site.

    The exit status is 0 when all that were asked are healthy, 3 when one has a trouble, 4 when none is there.
    """

    of: Literal["all", "robot", "link", "operator"] = "all"
    """Ask the processes of one kind alone; then one must be there."""
    json: bool = False
    """Print what they said, and the troubles, as JSON."""
    forget: bool = False
    """Forget the processes that have ended before."""

    def run(self) -> int:
        """Do it."""
        from farhand.deploy.status import run_status

        return run_status(self.of, self.json, self.forget)


COMMANDS = {
    "up": Up, "demo": Demo, "local": Local, "remote": Remote, "link": Link, "status": Status, "learn": Learn, "rollout": Rollout,
    "model": Model, "evaluate": Evaluate, "import": Import, "samples": Samples, "pki": Pki,
}  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Returns:
        The exit status: 0 for success, 2 for input that is wrong, 130 for Ctrl-C, 1 for what else failed.
    """
    with standard_streams() as streams:
        try:
            chosen = tyro.extras.subcommand_cli_from_dict(
                COMMANDS,
                prog="farhand",
                description="Supervisory teleoperation: demonstrate here, execute there. `farhand --version` says which Farhand this is.",
                args=arguments,
                config=(tyro.conf.FlagCreatePairsOff, tyro.conf.HelptextFromCommentsOff),
            )
        except SystemExit as end:  # after --help, or after what is wrong with the arguments
            return streams.final_status(end.code if isinstance(end.code, int) else 1)
        configure_logging(type(chosen).__name__.lower())
        return streams.final_status(status_of(chosen))


if __name__ == "__main__":
    sys.exit(run())
