"""What the robot looks like, from a real arm's catalogue: fetched once, kept by its hash, known beforehand where it is alike."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest

from farhand.common.arm.cell import Cell, Plug
from farhand.common.arm.simulation.description import describe, sketch
from farhand.common.clock import BootClock
from farhand.common.impairment.link_profile import find_profile, load_profiles
from farhand.common.link.endpoint import EndpointSettings
from farhand.common.link.interface import Answered
from farhand.common.mode_table import ControlMode
from farhand.common.task import TaskSet
from farhand.common.wire import keys
from farhand.common.wire.codec import decode
from farhand.common.wire.messages import BlobRequest, Stamp, Telemetry
from farhand.common.wire.scene_description import SceneDescription
from farhand.deploy.link.link_process import PROFILES_FILE
from farhand.deploy.places import find_robot
from farhand.evaluation.harness.virtual_sites import VirtualSites
from farhand.local_site.console.catalogue import RobotCatalogue
from farhand.local_site.exchange.fetching import KnownScenes
from farhand.local_site.exchange.requests import Requests
from farhand.local_site.teaching.library import Library
from farhand.remote_site.config import RemoteConfig
from farhand.remote_site.robot import Robot
from tests.cells import JACO
from tests.local_site.robot_end import HOT_STAB
from tests.loopback import Question, RobotsEnd

OWN = describe(JACO)
OTHER_CELL = Cell(robot=JACO.robot, plug=Plug(radius_m=0.015))
OTHER, SKETCH = describe(OTHER_CELL), sketch(OTHER_CELL)


class Arm:
    """A real arm's robot, which answers one question at a time."""

    def __init__(self) -> None:
        self.end = RobotsEnd()
        self.robot = Robot(
            RemoteConfig(),
            TaskSet([HOT_STAB]),
            BootClock("boot"),
            self.end,
            lambda _: None,
            lambda **_: None,
            None,
            cell=JACO,
        )
        self.n_parts, self.now_s = 0, 0.0
        self.inquiries = Requests(self, lambda job: job(), lambda: self.now_s)  # type: ignore[arg-type]
        self._asked: deque[tuple[Callable[[], object], Answered]] = deque()

    def looks(self, scene: SceneDescription) -> None:
        self.robot.supervisor.recordings.catalogue.show(scene.content)

    def ask(self, channel: keys.Channel, data: bytes, timeout_s: float, answered: Answered) -> None:
        self.n_parts += channel is keys.BLOB and bool(decode(data, BlobRequest))
        self._asked.append((partial(self.end.servers[channel], Question(data, answered)), answered))

    def answer_one(self) -> bool:
        if not self._asked:
            return False
        serve, _ = self._asked.popleft()
        serve()
        self.robot.handle()
        return True

    def lose_one(self) -> None:
        """A question, or its answer, is lost; a while later it is asked again."""
        _, answered = self._asked.popleft()
        answered(None)
        self.now_s += 1.0
        self.inquiries.tick(self.now_s)


def report(boot: str = "boot") -> Telemetry:
    return Telemetry(
        seq=1,
        stamp=Stamp(boot, 1),
        mode=ControlMode.DISARMED,
        position_m=(0.0, 0.0, 0.0),
        frame_origin_m=(0.0, 0.0, 0.0),
    )


@pytest.fixture(scope="module")
def arm() -> Arm:
    return Arm()


def site(arm: Arm, folder: Path, *own: SceneDescription, rate_bps: float = 0.0) -> RobotCatalogue:
    """An operator's site that has just heard of the robot."""
    known, library = KnownScenes(folder / "scenes", own), Library(TaskSet([HOT_STAB]), folder)
    catalogue = RobotCatalogue(
        arm.inquiries, library, "ann", lambda what, text, good=True: None, rate_bps, known
    )
    arm.n_parts = 0
    catalogue.on_report(report())
    assert arm.answer_one()  # the catalogue
    return catalogue


def test_a_robot_that_looks_like_the_operators_own_arm_costs_nothing(arm: Arm, tmp_path: Path):
    arm.looks(OWN)
    scene = site(arm, tmp_path, OWN).scene
    assert scene.description is OWN and scene.fetching is None
    assert not arm.answer_one() and arm.n_parts == 0


def test_another_robot_is_fetched_in_parts_and_known_to_the_next_process(arm: Arm, tmp_path: Path):
    arm.looks(OTHER)
    scene, shares = site(arm, tmp_path, OWN).scene, []
    while scene.description is None:
        assert scene.fetching is not None
        shares.append(scene.fetching)
        assert arm.answer_one()
    assert scene.description == OTHER and scene.fetching is None
    assert shares == sorted(shares) and shares[0] == 0.0 and shares[-1] > 0.8 and len(shares) == arm.n_parts
    again = site(arm, tmp_path, OWN).scene
    assert again.description == OTHER and arm.n_parts == 0


def test_a_damaged_file_is_fetched_anew(arm: Arm, tmp_path: Path):
    arm.looks(OTHER)
    (tmp_path / "scenes").mkdir()
    for content in (b"rubbish", OWN.content):
        (tmp_path / "scenes" / f"{OTHER.sha256}.scene").write_bytes(content)
        scene = site(arm, tmp_path).scene
        assert scene.description is None and scene.fetching == 0.0
        while arm.answer_one():
            pass
        assert scene.description == OTHER


def test_what_could_not_be_fetched_is_fetched_with_a_later_report(arm: Arm, tmp_path: Path):
    arm.looks(OTHER)
    catalogue = site(arm, tmp_path, OWN)
    arm.lose_one()
    assert catalogue.scene.fetching == 0.0
    arm.now_s += 1000.0  # beyond all patience
    arm.lose_one()
    assert catalogue.scene.fetching is None and catalogue.scene.description is None
    catalogue.on_report(report())
    while arm.answer_one():
        pass
    assert catalogue.scene.description == OTHER


def test_a_restarted_robot_that_looks_otherwise_is_drawn_otherwise(arm: Arm, tmp_path: Path):
    arm.looks(OTHER)
    catalogue = site(arm, tmp_path, OWN, OTHER)
    assert catalogue.scene.description is OTHER
    arm.looks(OWN)
    catalogue.on_report(report("next boot"))
    while arm.answer_one():
        pass
    assert catalogue.scene.description is OTHER  # the answer was of the boot before
    catalogue.on_report(report("boot"))
    while arm.answer_one():
        pass
    assert catalogue.scene.description is OWN


def test_an_arm_says_what_it_looks_like(arm: Arm):
    assert SceneDescription.from_bytes(arm.robot.embodiment.hardware.scene()) == OWN


# Slow links ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["panda", "baxter-right"])
def test_the_first_look_over_an_acoustic_modem_comes_within_a_minute(name: str, tmp_path: Path):
    profile = find_profile(load_profiles(PROFILES_FILE), "acoustic")
    endpoint = EndpointSettings(listen="tcp/127.0.0.1:0", rate_bps=profile.downlink.rate_bps)
    config, known = RemoteConfig(robot=name, link=endpoint), KnownScenes(tmp_path / "scenes", (OWN,))
    library = Library(TaskSet([HOT_STAB]), tmp_path)
    sites = VirtualSites(library, profile.settings, config, own_arm="jaco", known=known)
    began_s, cell = sites.time.now_s(), Cell(robot=find_robot(name))
    while (seen := sites.console.picture.robot_scene) is None and sites.time.now_s() < began_s + 60.0:
        sites.run(0.5)
    assert seen is not None
    assert seen == sketch(cell) and sites.console.picture.scene_fetching is not None
    assert KnownScenes(tmp_path / "scenes").get(seen.sha256) == seen  # the next process has it at once


def test_a_sketch_gives_way_to_the_drawing_and_a_fast_link_needs_none(arm: Arm, tmp_path: Path):
    arm.robot.supervisor.recordings.catalogue.show(OTHER.content, SKETCH.content)
    slow, seen = site(arm, tmp_path, OWN, rate_bps=9600.0).scene, []
    while arm.answer_one():
        if slow.description not in (None, *seen[-1:]):
            seen.append(slow.description)
    assert seen == [SKETCH, OTHER] and slow.fetching is None
    fast, n_parts = site(arm, tmp_path / "fast", OWN).scene, 0
    while arm.answer_one():
        n_parts += 1
        assert fast.description in (None, OTHER)
    assert fast.description == OTHER and n_parts < 10
