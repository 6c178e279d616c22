"""`farhand local`, `farhand remote`, `farhand link`: one process each.

Each function imports only its own site, so that the link starts without the method's compiled code.
"""

from __future__ import annotations

import asyncio
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import msgspec
from msgspec import structs

from farhand.common.address import parse_address
from farhand.common.errors import InvalidConfiguration
from farhand.common.impairment.link_control import RelayControl
from farhand.common.process_status import LinkFacts
from farhand.common.whole_file import write_whole
from farhand.common.wire.codec import field_of
from farhand.deploy.child_process import follow_parent, say_ready
from farhand.deploy.outcome import on_end_signal
from farhand.deploy.status_socket import Identity, serve_status

if TYPE_CHECKING:
    from farhand.common.link.endpoint import EndpointSettings
    from farhand.local_site.config import LocalConfig
    from farhand.local_site.site import LocalSite

S = TypeVar("S", bound=msgspec.Struct)


def configured(kind: type[S], file: Path | None, **overrides: object) -> S:
    """Return a configuration from defaults, then the file, then the command line.

    Args:
        kind: Type of the configuration.
        file: TOML file; None for none.
        overrides: Values of fields; those of the link have the prefix `link_`, the name of a driver has the suffix
            `_use`; None overrides nothing.

    Raises:
        InvalidConfiguration: Naming the field.
    """
    from farhand.common.configuration import check_values, load_toml

    base = load_toml(file, kind) if file is not None else kind()
    plain = msgspec.to_builtins(base)
    for name, value in overrides.items():
        if value is None:
            continue
        section, field = name.rsplit("_", 1) if name.endswith("_use") else ("", name)
        if name in _LINK_FIELDS:
            section, field = "link", name.removeprefix("link_")
        check_values({name: value}, "command line")
        (plain[section] if section else plain)[field] = value
    try:
        return msgspec.convert(plain, kind)
    except msgspec.ValidationError as error:
        raise InvalidConfiguration("command line", *field_of(error)) from error


_LINK_FIELDS = (
    "link_listen",
    "link_connect",
    "link_vehicle",
    "link_rate_bps",
    "link_certificates",
    "link_sites",
    "link_insecure",
)


def run_remote(config_file: Path | None, **overrides: object) -> int:
    """Serve one robot until SIGTERM or Ctrl-C."""
    from farhand.common.link.refusals import transport_refusals
    from farhand.deploy.places import data_folder, find_cell, find_tasks
    from farhand.remote_site.config import RemoteConfig
    from farhand.remote_site.robots.installed import check_drivers
    from farhand.remote_site.site import RemoteSite

    follow_parent()
    config = configured(RemoteConfig, config_file, **_either_way(overrides))
    tasks = find_tasks(config.task)
    check_drivers(config, tasks.first)
    cell = find_cell(tasks.first, config.robot)
    site = RemoteSite(config, tasks, data_folder(config.data_dir), cell)
    _check_certified_name(config.link, "vehicle", config.link.vehicle)
    who = Identity("robot", config.link.vehicle, config.link.endpoint, tasks.names)
    with serve_status(who, site.facts, site.data_folder), transport_refusals(site.tell_refused):
        site.warm_up()  # a signal ends this at once; what follows ends in order
        on_end_signal(site.stop)
        site.run(say_ready)
    return 0


def _either_way(overrides: dict[str, object]) -> dict[str, object]:
    """Return the options of a robot, which replace a listening endpoint of the file by that of a hub, or the reverse."""
    if overrides.get("link_connect") and overrides.get("link_listen") is None:
        return overrides | {"link_listen": "", "link_sites": overrides.get("link_sites") or ""}
    if overrides.get("link_listen") and overrides.get("link_connect") is None:
        return overrides | {"link_connect": ""}
    return overrides


def run_local(options: object, config_file: Path | None, **overrides: object) -> int:
    """Serve one operator until SIGTERM or Ctrl-C; for several robots in a process for each.

    Args:
        options: The command's options, as a dataclass.
        config_file: TOML file; None for none.
        overrides: See `configured`.
    """
    from farhand.deploy.fleet.consoles import run_consoles
    from farhand.local_site.config import LocalConfig

    config = configured(LocalConfig, config_file, **overrides)
    if len(config.robot_names) > 1:
        return run_consoles(options, config)
    follow_parent()
    site, who = _local_site(config)
    with serve_status(who, site.facts, site.data_folder):
        site.warm_up()  # a signal ends this at once; what follows ends in order
        on_end_signal(site.stop)
        site.run(say_ready)
    return 0


def run_scripted(outage: str, json_file: Path | None, config_file: Path | None, **overrides: object) -> int:
    """Run the scripted job once.

    Returns:
        0 only when the task succeeded, or was done and nobody can judge it.
    """
    from farhand.deploy.places import check_writable
    from farhand.local_site.config import LocalConfig

    follow_parent()
    planned = parse_outage(outage)
    if json_file is not None:
        check_writable("json", json_file)
    config = configured(LocalConfig, config_file, **overrides)
    site, who = _local_site(config)
    with serve_status(who, site.facts, site.data_folder):
        result = site.run_script(planned, say_ready)
    text = json.dumps(result)
    sys.stdout.write(text + "\n")
    if json_file is not None:
        write_whole(json_file, f"{json.dumps(result, indent=2)}\n".encode())
    return 1 if result["success"] is False else 0  # None: done, and nobody can judge it


def _local_site(config: LocalConfig) -> tuple[LocalSite, Identity]:
    """Return the operator's site, and its identity for `farhand status`.

    Each robot of a hub has a folder of its own, whether it is operated alone or beside others.
    """
    from farhand.deploy.places import data_folder, find_cell, find_tasks, sample_files, site_name
    from farhand.local_site.site import LocalSite

    tasks, folder = find_tasks(config.task), data_folder(config.data_dir)
    name = config.site_name or _certified_name(config.link) or site_name(folder)
    _check_certified_name(config.link, "site_name", name)
    cell = find_cell(tasks.first, config.own_arm)
    own, called = folder, name
    if len(names := config.robot_names) > 1:
        expected = f"one robot for the scripted operator, got {config.robots!r}"
        raise InvalidConfiguration("command line", "robots", expected)
    for robot in names:
        config = structs.replace(config, link=structs.replace(config.link, vehicle=robot))
        own, called = data_folder(folder / "robots" / robot), f"{name}@{robot}"
    site = LocalSite(config, name, tasks, own, sample_files, cell, token_dir=folder)
    return site, Identity("operator", called, config.link.connect, tasks.names)


def _certified_name(link: EndpointSettings) -> str:
    """Return the name in the site's certificate, empty without one."""
    from farhand.common.link.certificates import SiteCertificate

    return SiteCertificate.load(link.certificate_folder).name if link.certificates else ""


def _check_certified_name(link: EndpointSettings, field: str, name: str) -> None:
    """Refuse a name that differs from that in the certificate: the other site would know this one by both.

    Raises:
        InvalidConfiguration: When it differs; names the field.
    """
    if (certified := _certified_name(link)) not in ("", name):
        raise InvalidConfiguration(
            "configuration", field, f"{certified!r}, as in the certificate, got {name!r}"
        )


def run_link_process(listen: str, target: str, control: str, profile: str, seed: int) -> int:
    """Run the simulated link until SIGTERM or Ctrl-C."""
    from farhand.deploy.link.link_process import run_link

    follow_parent()
    where, to, control_at = (
        parse_address(text, field)
        for field, text in (("listen", listen), ("target", target), ("control", control))
    )
    controls: list[RelayControl] = []

    def ready(data: tuple[str, int], bound: tuple[str, int]) -> None:
        # Asked over the control socket, because the relay's own event loop must answer.
        controls.append(RelayControl(*bound, timeout_s=1.0))
        say_ready(port=data[1], control_port=bound[1])

    def facts() -> LinkFacts | None:
        return LinkFacts.of(controls[0].status()) if controls else None

    with serve_status(Identity("link", listen, listen), facts):
        asyncio.run(run_link(where, to, control_at, profile=profile, seed=seed, ready=ready))
    return 0


def parse_outage(text: str):
    """Return a planned outage from `none`, kind:seconds or kind:seconds@part.

    Raises:
        InvalidConfiguration: When the text has another form.
    """
    from farhand.local_site.script.scripted_actions import PlannedOutage

    if text in ("", "none"):
        return None
    kind, _, rest = text.partition(":")
    seconds, _, part = rest.partition("@")
    try:
        duration_s, at = float(seconds), float(part or 0.5)
    except ValueError:
        duration_s = at = 0.0
    if kind not in ("stall", "reset", "blackhole") or not 0.0 < duration_s <= 600.0 or not 0.0 <= at <= 1.0:
        expected = (
            "none, or stall:SECONDS, reset:SECONDS or blackhole:SECONDS up to 600, perhaps with @PART of the "
            f"motion from 0 to 1, got {text!r}"
        )
        raise InvalidConfiguration("command line", "outage", expected)
    return PlannedOutage(kind, duration_s, at)
