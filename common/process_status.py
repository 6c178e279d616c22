"""Facts that each process answers to `farhand status`; `deploy/diagnosis.py` judges them."""

from __future__ import annotations

import errno
import shutil
from pathlib import Path
from typing import Any, Literal

from msgspec import Struct

from farhand.common.wire.messages import SCHEMA

Role = Literal["robot", "link", "hub", "operator"]


class DataFolder(Struct, frozen=True, kw_only=True):
    """Folder for everything that must outlive the process.

    Args:
        path: The folder.
        free_bytes: Free space on its disk [B].
        write_error: Reason why the newest write to it failed; empty while writing works.
        full: True if the disk was full.
    """

    path: str
    free_bytes: int
    write_error: str = ""
    full: bool = False

    @classmethod
    def of(cls, path: Path, *errors: OSError | None) -> DataFolder:
        """Return the present state of a folder that may not exist yet.

        Args:
            path: The folder.
            errors: Errors of the writers; None for a successful newest write.
        """
        existing = next(folder for folder in (path, *path.absolute().parents) if folder.exists())
        error = next((error for error in errors if error is not None), None)
        return cls(
            path=str(path),
            free_bytes=shutil.disk_usage(existing).free,
            write_error=f"{error.filename or path}: {error.strerror}" if error is not None else "",
            full=error is not None and error.errno in (errno.ENOSPC, errno.EDQUOT),
        )


class RobotFacts(Struct, frozen=True, kw_only=True, tag_field="of", tag="robot"):
    """State of the robot's process.

    Args:
        mode: Mode of the robot.
        phase: Phase of AUTONOMOUS.
        holder: Site in control, empty for none.
        heard_s: Time since the operator was last heard [s]; None before.
        tick_age_s: Time since the newest control period began [s].
        overruns: Control periods skipped in this boot.
        control_hz: Control rate [Hz].
        model: First digits of the newest verified model's hash.
        stopped_because: Reason why the robot is STOPPED, empty in other modes.
        stopped_by_fault: True if a guard stopped it rather than an operator.
        waiting: Number of messages that wait for the control loop.
        not_understood: Reason why a connected site is not understood; empty for none.
        misnamed: Number of refused requests under another name than that in the sender's certificate.
    """

    mode: str
    phase: str
    holder: str
    heard_s: float | None
    tick_age_s: float
    overruns: int
    control_hz: float
    model: str
    stopped_because: str
    stopped_by_fault: bool
    waiting: int
    not_understood: str = ""
    misnamed: int = 0


class LinkFacts(Struct, frozen=True, kw_only=True, tag_field="of", tag="link"):
    """State of the simulated link.

    Args:
        target: The robot's address.
        profile: Name of the settings.
        outage: Kind of the present outage, `none` without one.
        outage_left_s: Remaining time of the outage [s].
        connections: Number of present connections.
        queued_bytes: Bytes in transit, both directions together [B].
        target_error: Reason why the newest connection to the target failed; empty if it succeeded.
    """

    target: str
    profile: str
    outage: str
    outage_left_s: float
    connections: int
    queued_bytes: int
    target_error: str

    @classmethod
    def of(cls, status: dict[str, Any]) -> LinkFacts:
        """Return the facts in an answer of `farhand.common.impairment.link_control.RelayControl`."""
        outage = status["outage"]
        return cls(
            target=status["target"], profile=status["profile"], outage=outage["kind"],
            outage_left_s=outage["remaining_s"], connections=status["connections"],
            queued_bytes=status["uplink"]["queued_bytes"] + status["downlink"]["queued_bytes"],
            target_error=status["target_error"],
        )  # fmt: skip


class HubFacts(Struct, frozen=True, kw_only=True, tag_field="of", tag="hub"):
    """State of a hub.

    Args:
        robots: Names of the robots that are there.
        connections: Names in the certificates of all connected sites; their addresses without certificates.
    """

    robots: tuple[str, ...]
    connections: tuple[str, ...]


class OperatorFacts(Struct, frozen=True, kw_only=True, tag_field="of", tag="operator"):
    """State of the operator's site.

    Args:
        page: Address of the page, empty without one.
        robot_mode: Mode that the robot last reported, empty before the first report.
        robot_phase: Phase that the robot last reported.
        robot_version: Version of the robot's Farhand, empty while unknown.
        robot_tasks: Tasks that the robot does, as far as known.
        robot_stopped_by_fault: True if a guard of the robot stopped it.
        holder: Site in control, as the robot reported.
        in_control: True if this site is in control.
        only_watches: True if this site does not want the control.
        why_not_in_control: Reason of the robot why this site is not in control; empty if it is.
        link: State of the reports: never, ok, late, lost.
        silent_s: Time since the newest report arrived [s]; None before the first one.
        age_s: Estimated age of the newest report [s]; None while unknown.
        round_trip_s: Newest measured round trip [s].
        not_understood: Reason why the newest dropped message was not understood; empty for none.
        relay: Simulated link before the robot; None without one, or when it does not answer.
        relay_error: Reason why the simulated link did not answer.
        waiting: Number of jobs that wait for the console.
        tick_age_s: Time since the console's last tick [s].
    """

    page: str
    robot_mode: str
    robot_phase: str
    robot_version: str
    robot_tasks: tuple[str, ...]
    robot_stopped_by_fault: bool
    holder: str
    in_control: bool
    only_watches: bool
    why_not_in_control: str
    link: str
    silent_s: float | None
    age_s: float | None
    round_trip_s: float | None
    not_understood: str
    relay: LinkFacts | None
    relay_error: str
    waiting: int
    tick_age_s: float


Facts = RobotFacts | LinkFacts | HubFacts | OperatorFacts


class ProcessStatus(Struct, frozen=True, kw_only=True):
    """Answer of one process.

    Args:
        role: Role of the process.
        name: Name of the vehicle, the hub or the operator's site, or the link's address.
        pid: Process id.
        uptime_s: Time since its start [s].
        version: Version of the process's Farhand.
        schema: Schema version of the process's messages.
        endpoint: Endpoint that the process listens on or connects to.
        tasks: Tasks of the robot, or those taught at the operator's site.
        data: Data folder of the process; None for the link, which has none.
        facts: State of the process; None while it starts.
    """

    role: Role
    name: str
    pid: int
    uptime_s: float
    version: str
    schema: int = SCHEMA
    endpoint: str = ""
    tasks: tuple[str, ...] = ()
    data: DataFolder | None = None
    facts: Facts | None = None
