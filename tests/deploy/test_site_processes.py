from __future__ import annotations

from pathlib import Path

import pytest

from farhand.common.errors import InvalidConfiguration
from farhand.deploy.site_processes import configured, parse_outage
from farhand.local_site.config import LocalConfig
from farhand.local_site.script.scripted_actions import PlannedOutage
from farhand.remote_site.config import RemoteConfig


def write(folder: Path, content: str) -> Path:
    file = folder / "site.toml"
    file.write_text(content)
    return file


def test_without_a_file_every_field_has_its_default():
    assert configured(RemoteConfig, None) == RemoteConfig()


def test_the_command_line_comes_before_the_file_and_the_file_before_the_default(tmp_path: Path):
    file = write(tmp_path, 'seed = 3\nlease_s = 5.0\n[link]\nlisten = "tcp/127.0.0.1:1"\nvehicle = "rov7"')
    config = configured(RemoteConfig, file, seed=4, link_listen="tcp/127.0.0.1:2", task=None)
    assert (config.seed, config.lease_s, config.task) == (4, 5.0, "planar")
    assert (config.link.listen, config.link.vehicle) == ("tcp/127.0.0.1:2", "rov7")


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("seed", -1),
        ("control_hz", 1.0),
        ("lease_s", float("nan")),
        ("max_age_s", float("inf")),
        ("nonsense", 1),
    ],
)
def test_a_wrong_word_on_the_command_line_is_named(field: str, value: object):
    with pytest.raises(InvalidConfiguration, match=f"command line.*{field}"):
        configured(RemoteConfig, None, **{field: value})


def test_a_wrong_field_of_the_file_is_named_with_the_file(tmp_path: Path):
    file = write(tmp_path, "page_port = -1")
    with pytest.raises(InvalidConfiguration, match=r"site\.toml: page_port"):
        configured(LocalConfig, file)


@pytest.mark.parametrize("arguments", [("",), ("--config=remote.toml",)])
def test_a_robot_without_an_endpoint_is_refused_with_the_field_and_an_example(
    arguments, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "remote.toml").write_text('[link]\nlisten = "tcp/127.0.0.1:7447"\n')
    with pytest.raises(
        InvalidConfiguration, match=r"link\.listen: an endpoint of this machine, such as tcp/127"
    ):
        configured(RemoteConfig, Path(arguments[0][9:]) if arguments[0] else None, link_listen="")


def test_an_ipv6_endpoint_is_taken():
    assert configured(RemoteConfig, None, link_listen="tcp/[::1]:7447").link.listen == "tcp/[::1]:7447"


def test_an_outage_is_a_kind_and_seconds_or_none():
    assert parse_outage("none") is None and parse_outage("") is None
    assert parse_outage("stall:10") == PlannedOutage("stall", 10.0)
    assert parse_outage("blackhole:0.5") == PlannedOutage("blackhole", 0.5)
    assert parse_outage("reset:3@0.25") == PlannedOutage("reset", 3.0, at=0.25)


@pytest.mark.parametrize(
    "text", ["stall", "stall:", "stall:0", "stall:-1", "stall:nan", "stall:1e9", "flood:3"]
)
def test_what_is_no_outage_is_refused(text: str):
    with pytest.raises(InvalidConfiguration, match="outage"):
        parse_outage(text)
