from __future__ import annotations

from pathlib import Path

import pytest

from farhand.common.configuration import load_toml
from farhand.common.errors import InvalidConfiguration
from farhand.remote_site.config import RemoteConfig

DEPLOY = Path(__file__).parents[2] / "deploy"


def test_the_configuration_that_comes_with_farhand_is_valid():
    config = load_toml(DEPLOY / "remote.toml", RemoteConfig)
    assert config.link.listen
    assert config.control_hz is None, "each robot has its own"


@pytest.mark.parametrize(
    ("line", "field"),
    [
        ("control_hz = 1.0", "control_hz"),
        ("telemetry_hz = 31.0", "telemetry_hz"),
        ("telemetry_hz = 0", "telemetry_hz"),
        ("lease_s = 0", "lease_s"),
        ("max_age_s = -1", "max_age_s"),
        ("seed = -1", "seed"),
        ("lease_s = nan", "lease_s"),
        ("speed = 1", "speed"),
        ("task = 3", "task"),
    ],
)
def test_a_wrong_field_is_named(tmp_path: Path, line: str, field: str):
    file = tmp_path / "remote.toml"
    file.write_text(line)
    with pytest.raises(InvalidConfiguration, match=field):
        load_toml(file, RemoteConfig)
