"""Profiles of the link from TOML, and changes to settings."""

from __future__ import annotations

from pathlib import Path

import pytest

import farhand.deploy
from farhand.common.errors import InvalidConfiguration
from farhand.common.impairment.impairment import DirectionSettings, LinkSettings
from farhand.common.impairment.link_profile import find_profile, load_profiles, update_settings

SHIPPED = Path(farhand.deploy.__file__).with_name("link_profiles.toml")
GOOD = """
[slow]
uplink = { delay_ms = 100 }
repeat_s = 30
timeline = [{ at_s = 5, uplink = { loss = 2 } }]

[slow.source]
delay_ms = "measured on the quay"
jitter_ms = "assumed"
distribution = "assumed"
rate_bps = "data sheet"
queue_bytes = "assumed"
loss = "assumed"
timeline = "assumed"

[slow.downlink]
delay_ms = 200
jitter_ms = 5
distribution = "normal"
rate_bps = 1e6
queue_bytes = 90_000
seed = 3
"""


def test_the_profiles_that_come_with_farhand_are_physical():
    profiles = load_profiles(SHIPPED)
    assert set(profiles) == {"lan", "geo", "leo", "acoustic"}
    for direction in (profiles["geo"].uplink, profiles["geo"].downlink):
        assert (direction.delay_ms, direction.jitter_ms) == (300, 20)
        assert direction.delay_ms - direction.jitter_ms >= 239  # light, up to the satellite and down
    assert 25 <= profiles["leo"].uplink.delay_ms <= 30
    assert profiles["acoustic"].uplink.delay_ms == pytest.approx(1e6 / 1500, rel=0.01)  # sound over 1 km
    assert profiles["leo"].over_time().at(30.1).uplink.delay_ms == 80  # a spike at every 15 s
    assert profiles["acoustic"].downlink.rate_bps == 9600
    assert 1 <= profiles["leo"].downlink.loss <= 2


def test_every_field_of_a_profile_is_read(tmp_path):
    (tmp_path / "links.toml").write_text(GOOD)
    slow = load_profiles(tmp_path / "links.toml")["slow"]
    assert slow.settings == LinkSettings(
        uplink=DirectionSettings(delay_ms=100),
        downlink=DirectionSettings(
            delay_ms=200, jitter_ms=5, distribution="normal", rate_bps=1e6, queue_bytes=90_000, seed=3
        ),
    )
    later = slow.over_time().at(35.0)
    assert later.uplink == DirectionSettings(delay_ms=100, loss=2)
    assert later.downlink == slow.downlink


@pytest.mark.parametrize(
    ("wrong", "instead", "field", "says"),
    [
        ("delay_ms = 100", "speed = 0.1", "slow.uplink", "unknown field `speed`.*delay_ms, jitter_ms"),
        ("delay_ms = 100", 'delay_ms = "fast"', "slow.uplink.delay_ms", "float"),
        ("delay_ms = 100", "delay_ms = nan", "slow.uplink", "delay_ms must be a finite number"),
        ("jitter_ms = 5", "jitter_ms = 500", "slow.downlink", "jitter_ms .* must not exceed"),
        ('"normal"', '"cauchy"', "slow.downlink.distribution", "cauchy"),
        ('rate_bps = "data sheet"', "", "slow.source.rate_bps", "where this figure comes from"),
        ('loss = "assumed"', "", "slow.source.loss", "where this figure comes from"),
        ("loss = 2", "loss = 200", "slow.timeline[0].uplink", "loss must be"),
        ("repeat_s = 30", "repeat_s = 5", "slow.repeat_s", "more than the last step's 5 s"),
        ("[slow]", "[slow", "", "a TOML file"),
    ],
)
def test_a_malformed_profile_is_refused_with_file_and_field(tmp_path, wrong, instead, field, says):
    path = tmp_path / "links.toml"
    path.write_text(GOOD.replace(wrong, instead))
    with pytest.raises(InvalidConfiguration, match=says) as caught:
        load_profiles(path)
    assert caught.value.source == str(path)
    assert caught.value.field == field


def test_a_missing_and_an_empty_file_are_refused(tmp_path):
    with pytest.raises(InvalidConfiguration, match=r"nothere.*a readable file"):
        load_profiles(tmp_path / "nothere.toml")
    (tmp_path / "empty.toml").write_text("")
    with pytest.raises(InvalidConfiguration, match="at least one profile"):
        load_profiles(tmp_path / "empty.toml")


def test_an_unknown_profile_is_refused_with_those_there_are():
    with pytest.raises(InvalidConfiguration, match=r"one of lan, geo, leo, acoustic, not 'mars'"):
        find_profile(load_profiles(SHIPPED), "mars")


def test_an_update_replaces_only_the_fields_it_names():
    before = LinkSettings(uplink=DirectionSettings(delay_ms=300, jitter_ms=20, seed=4))
    after = update_settings(before, uplink={"delay_ms": 500}, downlink={"rate_bps": 9600})
    assert after.uplink == DirectionSettings(delay_ms=500, jitter_ms=20, seed=4)
    assert after.downlink == DirectionSettings(rate_bps=9600)


@pytest.mark.parametrize("changes", [{"delay_ms": 10}, {"speed": 1}, {"delay_ms": "1"}])
def test_an_update_that_makes_no_sense_is_refused(changes):
    before = LinkSettings(uplink=DirectionSettings(delay_ms=300, jitter_ms=20))
    with pytest.raises(InvalidConfiguration, match="uplink"):
        update_settings(before, uplink=changes, downlink={"delay_ms": 1})
