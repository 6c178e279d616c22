"""One operator's sites for several robots: what each process is started with, and what is refused."""

from __future__ import annotations

from pathlib import Path

import msgspec
import pytest

from farhand.common.errors import InvalidConfiguration
from farhand.deploy.cli import Local
from farhand.deploy.fleet.consoles import child_arguments, page_ports
from farhand.deploy.site_processes import configured
from farhand.local_site.config import LocalConfig


def test_each_robot_is_operated_with_the_same_options_on_a_port_of_its_own():
    ports = page_ports(("rov1", "rov2"), 8080)
    options = Local(
        connect="quic/hub:7450", robots="rov1,rov2", port=8080, certificates="shore-1", task="planar", watch=True, data_dir="/data"
    )  # fmt: skip
    assert child_arguments(options, "rov2", ports) == [
        "local", "--connect=quic/hub:7450", "--certificates=shore-1", "--task=planar", "--watch", "--data-dir=/data",
        "--outage=none", "--robots=rov2", "--port=8081", "--pages=rov1=8080,rov2=8081", "--connect-timeout-s=0",
    ]  # fmt: skip


def test_the_pages_that_a_process_is_told_are_those_that_were_chosen():
    config = configured(LocalConfig, None, robots="rov2", pages="rov1=8080,rov2=8081")
    assert config.robot_names == ("rov2",)
    assert config.page_ports == {"rov1": 8080, "rov2": 8081}


@pytest.mark.parametrize("first", [0, 65535])
def test_robots_without_room_for_their_pages_are_refused(first: int):
    with pytest.raises(InvalidConfiguration, match=r"port: the port of the first robot's page"):
        page_ports(("rov1", "rov2"), first)


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"robots": "rov1,rov1"}, "robots: at most 16 names, each once"),
        ({"robots": ",".join(f"rov{k}" for k in range(17))}, "robots: at most 16 names"),
        ({"robots": "rov1,../rov2"}, "robots: a name of letters"),
        ({"robots": "rov1", "pages": "rov2=8080"}, "pages: the port of each robot's page"),
        ({"robots": "rov1", "pages": "rov1=8080,rov2"}, "pages: the port of each robot's page"),
    ],
)
def test_robots_that_could_not_be_told_apart_are_refused(fields: dict[str, str], words: str):
    with pytest.raises((InvalidConfiguration, msgspec.ValidationError), match=words):
        configured(LocalConfig, None, **fields)


def test_the_robots_can_be_named_in_the_file(tmp_path: Path):
    file = tmp_path / "local.toml"
    file.write_text('robots = "rov1, rov2"\n[link]\nconnect = "tcp/127.0.0.1:7450"\n')
    assert configured(LocalConfig, file).robot_names == ("rov1", "rov2")
