from __future__ import annotations

from pathlib import Path

import pytest

from farhand.common.configuration import load_toml
from farhand.common.errors import InvalidConfiguration
from farhand.local_site.config import LocalConfig

DEPLOY = Path(__file__).parents[2] / "deploy"


def test_the_configuration_that_comes_with_farhand_is_valid():
    config = load_toml(DEPLOY / "local.toml", LocalConfig)
    assert config.link.connect
    assert config.page_port, "an operator needs a page"


@pytest.mark.parametrize(
    ("line", "field"),
    [
        ('site_name = ""', "site_name"),
        ('site_name = "longer than sixteen"', "site_name"),
        ('site_name = "../../evil"', "site_name: Expected a name of letters, digits"),
        ('site_name = "two\\nlines"', "site_name: "),
        ('site_name = "line feed\\n"', "site_name: "),
        ('[link]\nvehicle = "rov/*"', "link.vehicle: Expected a name of letters, digits"),
        ('[link]\nconnect = ""', "link.connect: the endpoint of the robot or of the link, such as tcp/"),
        (
            '[link]\nconnect = "127.0.0.1:7447"',
            "connect: tcp/, tls/, ws/, quic/, udp/ and HOST:PORT, such as tcp/",
        ),
        ('link_control = "::1:7449"', "link_control: HOST:PORT, such as"),
        ("page_port = 70000", "page_port"),
        ("connect_timeout_s = -1", "connect_timeout_s"),
        ("connect_timeout_s = inf", "connect_timeout_s"),
        ("page = 1", "page"),
    ],
)
def test_a_wrong_field_is_named(tmp_path: Path, line: str, field: str):
    file = tmp_path / "local.toml"
    file.write_text(line)
    with pytest.raises(InvalidConfiguration, match=field):
        load_toml(file, LocalConfig)
