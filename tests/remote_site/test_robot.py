from __future__ import annotations

from pathlib import Path

import pytest

from farhand.common.impairment.link_profile import find_profile, load_profiles
from farhand.common.link.budget import part_bytes
from farhand.common.link.endpoint import EndpointSettings
from farhand.common.link.interface import Signed
from farhand.common.mode_table import Action
from farhand.common.wire import keys
from farhand.common.wire.codec import decode, encode
from farhand.common.wire.messages import EventKind, LeaseReply, LeaseRequest, Stop
from farhand.common.wire.motion_encoding import duration_s
from farhand.common.wire.reasons import Code
from farhand.deploy.link.link_process import PROFILES_FILE
from farhand.local_site.console import intents
from farhand.remote_site.config import RemoteConfig
from tests.loopback import Question
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


def test_the_lease_takes_the_name_in_the_certificate_and_another_one_is_refused_and_counted():
    meeting = Meeting()

    def asked(certified: str, name: str) -> LeaseReply:
        answers: list[bytes | None] = []
        request = LeaseRequest(session=f"process of {certified}", site_name=name)
        meeting.robots_end.servers[keys.LEASE](Question(Signed(encode(request), certified), answers.append))
        meeting.run(0.1)
        (answer,) = answers
        assert answer is not None
        return decode(answer, LeaseReply)

    contact = meeting.robot.supervisor.contact
    refused = asked("thief", "shore-1")
    assert not refused.granted and refused.reason is not None and refused.lease_id == ""
    assert (refused.reason.code, contact.misnamed, contact.lease.holder) == (Code.OTHER_NAME, 1, "")
    assert asked("shore-1", "shore-1").granted and contact.lease.holder == "shore-1"
    assert not asked("thief", "shore-1").granted  # nor does it take over as the holder restarted
    assert (contact.misnamed, contact.lease.holder) == (2, "shore-1")
    assert not asked("thief", "thief").granted  # held by shore-1: by its own name it waits like anybody
    assert contact.misnamed == 2


def test_a_stop_counts_whoever_it_says_it_is_from_and_is_told_under_the_certificates_name():
    meeting = Meeting()
    meeting.robots_end.hear(keys.STOP, Signed(encode(Stop(stop_id="1", site_name="shore-1")), "watcher"))
    meeting.run(0.1)
    assert meeting.mode.name == "STOPPED"
    event = meeting.robot.supervisor.events.newest(EventKind.STOPPED)
    assert event is not None and event.who == "watcher"
