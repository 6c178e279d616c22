from __future__ import annotations

from pathlib import Path

import pytest

from farhand.common.control_mode import Action
from farhand.common.impairment.link_profile import find_profile, load_profiles
from farhand.common.link.budget import part_bytes
from farhand.common.link.endpoint import EndpointSettings
from farhand.common.wire.motion_encoding import duration_s
from farhand.deploy.link.link_process import PROFILES_FILE
from farhand.local_site.console import intents
from farhand.remote_site.config import RemoteConfig
from tests.meeting import Meeting


def test_a_path_is_thinned_for_the_link_that_it_is_announced_over(tmp_path: Path):
    acoustic = find_profile(load_profiles(PROFILES_FILE), "acoustic").settings.downlink.rate_bps
    paths = []
    for rate_bps in (0.0, acoustic):
        config = RemoteConfig(link=EndpointSettings(listen="tcp/127.0.0.1:0", rate_bps=rate_bps))
        site = Meeting(config=config).join("ann", tmp_path / f"{rate_bps:g}")
        slowly = intents.CommandRobot(Action.SET_PACE, pace=0.25)  # so that it is a long path
        picture = site.ask(intents.LoadSamples(), intents.SendModel(), Action.ARM, slowly, Action.PREVIEW)
        assert picture.path is not None and picture.path.reaches_end
        paths.append(picture.path)
    whole, thin = paths
    assert len(thin.points) <= part_bytes(acoustic) < len(whole.points)
    assert duration_s(thin) == pytest.approx(duration_s(whole), abs=thin.step_s)
