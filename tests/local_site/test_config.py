from __future__ import annotations

from pathlib import Path

import pytest

from farhand.common.errors import InvalidConfiguration
from farhand.common.task import load_toml
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
