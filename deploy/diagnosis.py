"""Diagnosis of this machine's processes: from their facts to causes, without the consequences."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from datetime import datetime

from msgspec import Struct

from farhand.common.process_status import LinkFacts, OperatorFacts, ProcessStatus, RobotFacts
from farhand.deploy.process_discovery import Entry

LOW_BYTES = 64_000_000
"""Free space below which the disk counts as full: recordings and events need some [B]."""
STANDSTILL_S = 1.5
"""Time without a new period after which a loop counts as standing still [s]."""


class Trouble(Struct, frozen=True, kw_only=True):
    """Fault with its remedy.

    Args:
        code: Kind of the fault, for programs.
        role: Role of the process that reports it.
        name: Name of that process.
        text: Fault.
        remedy: Remedy.
    """

    code: str
    role: str
    name: str
    text: str
    remedy: str


def diagnose(found: Sequence[Entry]) -> list[Trouble]:
    """Return the troubles of all processes, each cause once."""
    troubles = [trouble for entry in found for trouble in _of_ended(entry)]
    for entry in found:
        if (status := entry.status) is not None:
            troubles += _of_process(status)
    troubles += _of_versions(found)
    robots = [entry.status for entry in found if entry.role == "robot" and entry.status is not None]
    for entry in found:
        if entry.status is not None and isinstance(entry.status.facts, OperatorFacts):
            troubles += _of_operator(entry.status, entry.status.facts, robots, {t.code for t in troubles})
    for entry in found:
        if entry.status is not None and isinstance(entry.status.facts, LinkFacts):
            troubles += _of_link(entry.status, entry.status.facts, {t.code for t in troubles})
    return troubles


def _of_ended(entry: Entry) -> Iterator[Trouble]:
    """Return the trouble of a process that does not answer."""
    about = f"the {entry.role} process {entry.name!r} ({entry.pid})"
    match entry.fault:
        case "dead":
            yield _trouble(
                entry, f"{entry.role}-dead", f"{about} was killed or has crashed",
                "start it again; `farhand status --forget` if it is no longer needed",
            )  # fmt: skip
        case "ended" if (words := entry.words) is not None:
            when = f"{datetime.fromtimestamp(words.at_s):%Y-%m-%d at %H:%M:%S}"
            yield _trouble(
                entry, words.code, f"{about} has ended on {when}: {words.text}",
                "remove the cause and start it again; `farhand status --forget` if it is no longer needed",
            )  # fmt: skip
        case "silent":
            yield _trouble(
                entry, "stale", f"{about} is there and does not answer: it is suspended, or the machine is overloaded",
                "`kill -CONT` continues a suspended process",
            )  # fmt: skip
        case "foreign":
            yield _trouble(
                entry, "version-differs", f"the answer of {about} is not understood", "run one version of Farhand everywhere"
            )  # fmt: skip


def _of_process(status: ProcessStatus) -> Iterator[Trouble]:
    """Return the troubles that do not depend on other processes."""
    data, facts = status.data, status.facts
    if data is not None and (data.full or data.free_bytes < LOW_BYTES):
        left = f"{data.path} is on a disk with {data.free_bytes / 1e6:.0f} MB left"
        text = f"{left}; {data.write_error}" if data.write_error else left
        yield _trouble(status, "disk-full", text, "make space: new recordings and events may be lost")
    elif data is not None and data.write_error:
        remedy = f"let this user write to {data.path}, or name another folder with --data-dir"
        yield _trouble(status, "not-kept", data.write_error, remedy)
    if facts is None:
        yield _trouble(status, "starting", "it is starting", "wait; a first start compiles for a minute")
    elif isinstance(facts, RobotFacts | OperatorFacts) and facts.tick_age_s > STANDSTILL_S:
        loop = "control loop" if isinstance(facts, RobotFacts) else "console"
        yield _trouble(
            status, "stale", f"its {loop} has stood still for {facts.tick_age_s:.1f} s",
            "the machine is overloaded, or a driver hangs: give it a core, or start it again",
        )  # fmt: skip
    if isinstance(facts, RobotFacts) and facts.not_understood:
        why = f"a site's messages are not understood: {facts.not_understood}"
        yield _trouble(status, "version-differs", why, "install one version on both sites")
    if isinstance(facts, RobotFacts) and facts.stopped_by_fault:
        remedy = "remove the cause, then press Reset and Arm on the page"
        yield _trouble(status, "robot-stopped", f"the robot has stopped: {facts.stopped_because}", remedy)


def _of_versions(found: Sequence[Entry]) -> Iterator[Trouble]:
    """Return the trouble of processes on one machine with different versions of Farhand."""
    known = [entry.status for entry in found if entry.status is not None]
    versions = {(status.version, status.schema): status for status in known}
    if len(versions) > 1:
        text = ", ".join(f"{status.role} {status.name!r} runs {status.version}" for status in known)
        yield _trouble(known[-1], "version-differs", text, "install one version and start all of them again")


def _of_operator(
    status: ProcessStatus, facts: OperatorFacts, robots: Sequence[ProcessStatus], known: set[str]
) -> Iterator[Trouble]:
    """Return the troubles that the operator's site sees in the robot or the link."""
    if facts.not_understood:
        yield _trouble(status, "version-differs", facts.not_understood, "install one version on both sites")
    elif facts.link in ("never", "lost"):
        yield from _of_silence(status, facts, robots, known)
    else:
        yield from _of_robot(status, facts, known)


def _of_silence(
    status: ProcessStatus, facts: OperatorFacts, robots: Sequence[ProcessStatus], known: set[str]
) -> Iterator[Trouble]:
    """Return the cause of the robot's silence, as far as this machine knows it."""
    where, relay, seen_s = status.endpoint, facts.relay, facts.silent_s or 0.0
    if facts.relay_error:
        if "link-dead" not in known:
            yield _trouble(status, "link-dead", facts.relay_error, "start `farhand link` again")
    elif relay is not None and relay.outage != "none":
        yield _cut(status, relay)
    elif known & {"robot-dead", "link-dead"} or ("stale" in known and not robots):
        return  # the cause is reported already
    elif facts.link == "never":
        why = f" ({relay.target}: {relay.target_error})" if relay is not None and relay.target_error else ""
        text = f"the site runs without a robot: no report has ever arrived from {where}{why}"
        yield _trouble(
            status, "page-only", text, "start the robot's site, and check that the link leads to it"
        )
    elif relay is not None and relay.target_error:
        text = f"the robot's site is gone: {relay.target}: {relay.target_error}"
        yield _trouble(status, "robot-dead", text, "start `farhand remote` again")
    elif robots and "stale" not in known:
        text = f"the robot is healthy, but no report of it has arrived for {seen_s:.0f} s"
        yield _trouble(status, "link-cut", text, f"check the link between {where} and the robot")
    elif "stale" not in known:
        text = f"no report of the robot has arrived for {seen_s:.0f} s: the page shows its old state"
        yield _trouble(status, "stale", text, "check the robot's site, and the link")


def _of_robot(status: ProcessStatus, facts: OperatorFacts, known: set[str]) -> Iterator[Trouble]:
    """Return the troubles that a heard robot reports."""
    lacking = [task for task in status.tasks if facts.robot_tasks and task not in facts.robot_tasks]
    if lacking:
        text = f"the robot's tasks are {', '.join(facts.robot_tasks)}; this site also teaches {', '.join(lacking)}"
        yield _trouble(status, "wrong-task", text, "start both sites with the same --task")
    if facts.robot_version not in ("", status.version) and "version-differs" not in known:
        text = f"the robot runs Farhand {facts.robot_version}, this site {status.version}"
        yield _trouble(status, "version-differs", text, "install one version on both sites")
    if facts.robot_stopped_by_fault and "robot-stopped" not in known:
        remedy = "read the reason under Events on the page, then press Reset and Arm"
        yield _trouble(status, "robot-stopped", "a guard has stopped the robot", remedy)
    if not facts.in_control and not facts.only_watches:
        text = f"this site is not in control: {facts.why_not_in_control or 'it has just asked'}"
        yield _trouble(status, "no-lease", text, "ask for the control on the page, or start with --watch")


def _of_link(status: ProcessStatus, facts: LinkFacts, known: set[str]) -> Iterator[Trouble]:
    if facts.outage != "none" and "link-cut" not in known:
        yield _cut(status, facts)
    elif facts.target_error and not known & {"robot-dead", "page-only", "port-taken", "failed", "starting"}:
        text = f"no robot's site answers at {facts.target}: {facts.target_error}"
        yield _trouble(status, "robot-dead", text, "start `farhand remote`")


def _cut(status: ProcessStatus, link: LinkFacts) -> Trouble:
    text = f"the link is cut ({link.outage}) for {link.outage_left_s:.0f} s more"
    return _trouble(
        status, "link-cut", text, "wait for its end, or press Cut on the page again with a shorter duration"
    )


def _trouble(of: Entry | ProcessStatus, code: str, text: str, remedy: str) -> Trouble:
    return Trouble(code=code, role=of.role, name=of.name, text=text, remedy=remedy)
